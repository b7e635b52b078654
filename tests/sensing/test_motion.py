"""Visual odometry of the ray-cast sensor, and its fusion with dead reckoning, against float64 NumPy."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.geometry.pose import Pose
from jaxbiped.localisation import Belief, predict
from jaxbiped.localisation.kalman_filter import predict_seen
from jaxbiped.sensing import VisualConfig
from jaxbiped.sensing.camera import MountedCamera, mount
from jaxbiped.sensing.motion import SHARE, nothing, overlap, track
from jaxbiped.sensing.view import Motion, View
from tests.reference import sensing as reference
from tests.sensing.scenes import CAMERA, IMAGE

NOISE = VisualConfig(failure=0).traced()
N = 400
RANGE = 1.3  # [m]
tracked = jax.jit(functools.partial(track, image=IMAGE))
overlapped = jax.jit(overlap)
fused = jax.jit(predict_seen)


def pose(x=0.8, y=0.5, z=0.0, yaw=0.3) -> Pose:
    return Pose(*(jnp.float32(v) for v in (x, y, z, yaw)))


def floor_view(seed=0, valid=True) -> View:
    """Points before the robot, on the floor and above it, one in ten not measured."""
    rng = np.random.default_rng(seed)
    x, y, z = rng.uniform(0.2, 1.5, N), rng.uniform(-0.7, 0.7, N), np.maximum(rng.uniform(-0.3, 0.3, N), 0)
    weight = np.where(rng.random(N) < 0.9, IMAGE.width * IMAGE.height / N, 0.0) * valid
    return View(*(jnp.asarray(v, jnp.float32) for v in (x, y, z, weight)))


@pytest.mark.parametrize("look", [False, True])
@pytest.mark.parametrize("after", [(0.85, 0.5, 0.0, 0.3), (0.8, 0.52, 0.03, 1.1), (0.8, 0.5, 0.0, -2.8)])
def test_overlap_is_what_the_camera_before_measures(after, look):
    view, at = floor_view(), mount(CAMERA, look)
    ours = float(overlapped(view, pose(*after), pose(), MountedCamera(CAMERA, at, IMAGE), RANGE))
    world = [np.asarray(v, float) for v in (view.x, view.y, view.z)]
    x, y, z, yaw = after
    cos, sin = np.cos(yaw), np.sin(yaw)
    world = np.stack([x + cos * world[0] - sin * world[1], y + sin * world[0] + cos * world[1], world[2] + z])
    origin, basis = reference.camera_pose(pose(), CAMERA, look)
    right, down, depth = basis.T @ (world - origin[:, None])
    u, v = (float(CAMERA.focal) * way / depth + c for way, c in zip((right, down), IMAGE.centre, strict=True))
    disparity = float(CAMERA.focal * CAMERA.baseline) / depth
    near = np.linalg.norm(world - origin[:, None], axis=0) <= RANGE
    there = near & (depth > 0) & (disparity <= 159) & (u >= disparity) & (u <= 511) & (v >= 0) & (v <= 383)
    theirs = np.mean(there & (np.asarray(view.weight) > 0))
    assert abs(ours - theirs) < 1.5 / N  # one point may lie on the border


def test_errors_are_as_large_as_claimed():
    view, after = floor_view(), pose(0.84, 0.53, 0.0, 0.6)
    at = mount(CAMERA)
    many = jax.vmap(lambda seed: track(view, after, pose(), at, CAMERA, NOISE, IMAGE, RANGE, seed))
    found = jax.device_get(jax.jit(many)(jnp.arange(4000, dtype=jnp.uint32)))
    assert found.seen.all()
    cos, sin = np.cos(0.3), np.sin(0.3)
    true = np.array([cos * 0.04 + sin * 0.03, -sin * 0.04 + cos * 0.03, 0.3])
    error = np.stack([found.x, found.y, found.yaw], axis=1) - true
    share = float(overlapped(view, after, pose(), MountedCamera(CAMERA, at, IMAGE), RANGE))
    sd = np.array([NOISE.forward, NOISE.left, NOISE.yaw]) * np.sqrt(SHARE / share)
    np.testing.assert_allclose(error.std(0), sd, rtol=0.06)  # five standard errors of 4,000 draws
    assert np.all(np.abs(error.mean(0)) < 5 * sd / np.sqrt(4000))
    np.testing.assert_allclose(found.cov[0], np.diag(sd**2), rtol=1e-4)


def test_nothing_in_common_or_nowhere_is_not_seen():
    at = mount(CAMERA)
    blind = floor_view(valid=False)
    for view, after in (
        (floor_view(), pose(yaw=0.3 + np.pi)),
        (blind, pose()),
        (floor_view(), pose(x=np.nan)),
        (floor_view(), pose(x=50.0)),
    ):
        found = tracked(view, after, pose(), at, CAMERA, NOISE, max_range=RANGE, seed=jnp.uint32(1))
        assert not found.seen
        assert all(not np.any(np.asarray(leaf)) for leaf in jax.tree.leaves(found))
    never = VisualConfig(failure=1.0).traced()
    assert not tracked(floor_view(), pose(), pose(), at, CAMERA, never, max_range=RANGE, seed=jnp.uint32(1)).seen


def belief(yaw=0.3) -> Belief:
    return Belief(pose(yaw=yaw), jnp.diag(jnp.array([1e-4, 2e-4, 1e-3])))


MOVED, VARIANCES = jnp.array([0.05, 0.01, 0.2]), jnp.array([1e-5, 2e-5, 1e-3])
COV = jnp.array([[4e-6, 1e-6, 0], [1e-6, 2e-6, 1e-6], [0, 1e-6, 1e-5]])


def test_two_tellings_of_one_motion_in_information_form():
    """The fused displacement is that of the sum of informations, in float64; then it is predicted with."""
    told = np.array([0.052, 0.008, 0.23])
    ours, good = fused(belief(), MOVED, VARIANCES, Motion(*jnp.asarray(told), COV, jnp.bool_(True)))
    assert good
    Q, R = np.diag(np.asarray(VARIANCES, float)), np.asarray(COV, float) + 1e-8 * np.eye(3)
    P = np.linalg.inv(np.linalg.inv(Q) + np.linalg.inv(R))
    dx, dy, dyaw = P @ (np.linalg.solve(Q, np.asarray(MOVED, float)) + np.linalg.solve(R, told))
    cos, sin = np.cos(0.3), np.sin(0.3)
    x, y = 0.8 + cos * dx - sin * dy, 0.5 + sin * dx + cos * dy
    np.testing.assert_allclose([ours.pose.x, ours.pose.y, ours.pose.yaw], [x, y, 0.3 + dyaw], atol=2e-6)
    F = np.array([[1, 0, 0.5 - y], [0, 1, x - 0.8], [0, 0, 1]])
    G = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    cov = F @ np.asarray(belief().cov, float) @ F.T + G @ P @ G.T
    np.testing.assert_allclose(ours.cov, cov, rtol=1e-4, atol=1e-10)


def test_what_was_not_seen_disagrees_or_is_not_finite_leaves_dead_reckoning():
    alone = predict(belief(), *MOVED, VARIANCES)
    right = Motion(*MOVED, COV, jnp.bool_(True))
    wrong = [nothing(), Motion(jnp.float32(0.3), *MOVED[1:], COV, jnp.bool_(True))]
    wrong += [Motion(jnp.float32(bad), *MOVED[1:], COV, jnp.bool_(True)) for bad in (np.nan, np.inf)]
    wrong += [Motion(*MOVED, COV * jnp.nan, jnp.bool_(True))]
    for motion in wrong:
        ours, good = fused(belief(), MOVED, VARIANCES, motion)
        assert not good
        for a, b in zip(jax.tree.leaves(ours), jax.tree.leaves(alone), strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-6, atol=1e-12)
    assert fused(belief(), MOVED, VARIANCES, right)[1]


def test_no_uncertainty_and_angles_round_the_back():
    still = fused(belief(), jnp.zeros(3), jnp.zeros(3), Motion(*jnp.zeros(3), jnp.zeros((3, 3)), jnp.bool_(True)))[0]
    assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(still))
    about = jnp.array([0.0, 0.0, np.pi - 0.01])
    told = Motion(jnp.float32(0), jnp.float32(0), jnp.float32(-np.pi + 0.01), COV, jnp.bool_(True))
    ours, good = fused(belief(), about, VARIANCES, told)
    assert good and abs(abs(float(ours.pose.yaw) - 0.3) - np.pi) < 0.02
