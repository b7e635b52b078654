"""Motion between two measurements: made-up features with a known motion, and rendered pairs."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.arenas import load_scene
from jaxbiped.geometry.pose import Pose
from jaxbiped.sensing.camera import mount, placed
from jaxbiped.sensing.config import CameraConfig
from jaxbiped.stereo import tracking
from jaxbiped.stereo.calibration import ideal
from jaxbiped.stereo.measure import StereoSensor

CAMERA = CameraConfig()
RIG = ideal(CAMERA)
AT = jax.device_get(mount(CAMERA.traced()))
MOTION = np.array([0.05, -0.02, 0.5])


EMPTY = tracking.find_features(np.zeros((384, 512), np.uint8), np.zeros((384, 512), np.float32), RIG, AT)


def features(points, descriptors, rng=None, noise=0.0):
    """What a camera would have found of points in the robot frame."""
    seen = tracking.project(points, EMPTY, RIG)
    seen = seen + (rng.normal(0, noise, seen.shape) * tracking.SPREAD if noise else 0)
    points = tracking.to_robot(seen, RIG, EMPTY.R, EMPTY.origin)
    return replace(EMPTY, seen=seen, points=points, descriptors=descriptors)


def scene(seed=0, count=150, motion=(0.05, -0.02, 0.5), tilt=0.01, noise=0.0):
    """The same points before and after a motion, with a body that tilts in between."""
    rng = np.random.default_rng(seed)
    low = np.column_stack([rng.uniform(0.35, 1.2, count), rng.uniform(-0.4, 0.4, count), rng.uniform(0, 0.2, count)])
    roll = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    x, y, yaw = motion
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    names = rng.uniform(0, 1, (count, 128)).astype(np.float32)
    after = (low - [x, y, 0]) @ turn @ roll.T
    return features(low, names, rng, noise), features(after, names, rng, noise)


def told(motion):
    return np.array([motion.x, motion.y, motion.yaw])


@pytest.mark.parametrize("motion", [(0.05, 0.0, 0.0), (0.03, 0.04, np.pi / 4), (0.0, 0.0, -np.pi / 2)])
def test_exact_points_give_the_exact_motion(motion):
    found = tracking.find_motion(*scene(motion=motion), RIG, np.array(motion))
    assert found.seen
    np.testing.assert_allclose(told(found), motion, atol=3e-4)  # tilting turns the heading in second order


def test_errors_are_as_large_as_claimed():
    """Normalised squared errors of 60 noisy pairs: at most those of chi-squared with three degrees, but for the
    inflation; less, since a robust weight takes some of each good match away."""
    nees = []
    for seed in range(60):
        found = tracking.find_motion(*scene(seed, noise=1 / np.sqrt(2), tilt=0.005), RIG, MOTION)
        error = told(found) - [0.05, -0.02, 0.5]
        nees.append(error @ np.linalg.solve(found.cov.astype(float), error) * tracking.INFLATION)
    assert 1.2 < np.mean(nees) < 4.3  # four standard errors


def test_wrong_matches_are_left_out():
    before, after = scene()
    rng = np.random.default_rng(1)
    wrong = rng.permutation(len(before.seen))[:60]
    names = after.descriptors.copy()
    names[wrong] = names[np.roll(wrong, 1)]  # two fifths of the matches join different points
    found = tracking.find_motion(before, replace(after, descriptors=names), RIG, MOTION)
    assert found.seen
    np.testing.assert_allclose(told(found), [0.05, -0.02, 0.5], atol=1e-4)


def cut(kept, some):
    return replace(kept, seen=kept.seen[some], points=kept.points[some], descriptors=kept.descriptors[some])


def test_too_little_in_common_is_no_motion():
    before, after = scene()
    none = slice(0, 0)
    few = slice(0, tracking.LEAST - 1)
    one = np.zeros(50, int)  # the same point fifty times
    line = np.arange(50)
    straight = scene()[0]
    points = np.column_stack([np.linspace(0.4, 1, 50), np.zeros(50), np.zeros(50)])
    straight = features(points, before.descriptors[line])
    other = np.random.default_rng(5).uniform(0, 1, after.descriptors.shape).astype(np.float32)
    for a, b in (
        (cut(before, none), after),
        (before, cut(after, none)),
        (cut(before, few), cut(after, few)),
        (cut(before, one), cut(after, one)),
        (before, replace(after, descriptors=other)),
        (straight, straight),
    ):
        found = tracking.find_motion(a, b, RIG, MOTION)
        assert np.all(np.isfinite(told(found))) and np.all(np.isfinite(found.cov))
        assert not found.seen or (a is straight)


def test_a_motion_far_from_dead_reckoning_is_not_believed():
    for astray in ([0.12, -0.02, 0.5], [0.05, -0.02, 0.9]):
        assert not tracking.find_motion(*scene(), RIG, np.array(astray)).seen
    assert tracking.find_motion(*scene(), RIG, MOTION + np.array([0, 0, 2 * np.pi])).seen


def test_duplicated_points_count_but_do_no_harm():
    before, after = scene()
    twice = np.concatenate([np.arange(150), np.arange(20)])
    found = tracking.find_motion(cut(before, twice), cut(after, twice), RIG, MOTION)
    assert found.seen
    np.testing.assert_allclose(told(found), [0.05, -0.02, 0.5], atol=1e-4)


@pytest.fixture(scope="module")
def sensor():
    made = StereoSensor(CAMERA)
    yield made
    made.close()


def shot(sensor, arena, x, y, yaw, tilt=0.0, seed=0):
    """What a robot there finds."""
    pose = Pose(*(jnp.float32(v) for v in (x, y, 0.0, yaw)))
    origin, basis = jax.device_get(placed(pose, AT, jnp.float32(tilt), jnp.float32(-tilt)))
    sensor.show(arena)
    pair = sensor.renderer.pair(origin, basis, CAMERA.image_noise, seed)
    return tracking.find_features(tracking.grey(pair.left), sensor.match(pair).value, RIG, AT)


@pytest.fixture(scope="module")
def arena(request):
    return jax.device_get(load_scene(request.config.rootpath / "configs" / "scenes" / "experiment_4.toml")[1])


def test_rendered_pairs_tell_the_motion(sensor, arena):
    """A step, a step with a turn of 45 degrees, and a turn of 90: within 1.5 mm and 0.15 degrees."""
    x, y, yaw = (float(v) for v in arena.start_xyyaw)
    first = shot(sensor, arena, x, y, yaw, seed=1)
    for k, (dx, dy, dyaw) in enumerate([(0.05, 0.0, 0.0), (0.035, 0.035, np.pi / 4), (0.0, 0.0, np.pi / 2)]):
        c, s = np.cos(yaw), np.sin(yaw)
        second = shot(sensor, arena, x + c * dx - s * dy, y + s * dx + c * dy, yaw + dyaw, tilt=0.005, seed=2 + k)
        found = tracking.find_motion(first, second, RIG, np.array([dx, dy, dyaw + 0.05]))
        assert found.seen
        error = told(found) - [dx, dy, dyaw]
        assert np.all(np.abs(error[:2]) < 0.0015) and abs(error[2]) < np.deg2rad(0.15), error


def test_plain_arenas_and_views_with_nothing_in_common_tell_nothing(sensor, arena):
    x, y, yaw = (float(v) for v in arena.start_xyyaw)
    first, behind = shot(sensor, arena, x, y, yaw), shot(sensor, arena, x, y, yaw + np.pi)
    assert not tracking.find_motion(first, behind, RIG, np.array([0, 0, np.pi])).seen
    boxes = replace(arena.boxes, contrast=np.zeros_like(arena.boxes.contrast))
    marks = replace(arena.landmarks, used=np.zeros_like(arena.landmarks.used))
    plain = replace(arena, boxes=boxes, landmarks=marks, floor_contrast=np.float32(0))
    nothing = shot(sensor, plain, x, y, yaw)
    found = tracking.find_motion(nothing, shot(sensor, plain, x + 0.05, y, yaw, seed=3), RIG, np.array([0.05, 0, 0]))
    assert not found.seen and len(nothing.seen) < tracking.LEAST
