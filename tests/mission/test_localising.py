"""Localisation without landmarks: what an agent makes of it, and missions in arenas where there is nothing to go by."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.arenas import load_scene
from jaxbiped.geometry.pose import Pose
from jaxbiped.localisation import predict
from jaxbiped.mission.batched_driver import stack
from jaxbiped.mission.localising import anchor_after_odometry, localise, sightings_without_landmarks
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import MissionConfig, mission_spec
from jaxbiped.mission.recorded_driver import run_bare
from jaxbiped.mission.sensor_rig import rig_for, view_names
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.state import start
from jaxbiped.sensing import Motion, Sightings, View
from jaxbiped.sensing.counter_rng import from_key
from jaxbiped.study.queues import run_all
from jaxbiped.study.workload import Workload

AREA = (1.8, 1.4)
MOVED, VARIANCES = jnp.array([0.05, 0.0, 0.0]), jnp.array([1e-6, 1e-6, 1e-4])
WAYS = "odometry", "visual", "icp", "both"
SEEDS = 16


def kind(way: str, **other):
    """Parameters and spec of one way of localisation."""
    config = MissionConfig(localisation=way, **other)
    return config.params("full"), mission_spec(config, AREA)


@pytest.fixture(scope="module")
def arena(request):
    return load_scene(request.config.rootpath / "configs" / "scenes" / "experiment_1.toml")[1]


def begin(arena, way: str):
    setup = MissionSetup(arena, *kind(way))
    return *start(setup, jnp.uint32(5)), setup


def blank_view(setup) -> View:
    return View(*(jnp.zeros(setup.spec.image.rows * setup.spec.image.columns),) * 4)


def sightings_of(arena, motion=None) -> Sightings:
    zero = jnp.zeros_like(arena.landmarks.x)
    return Sightings(zero, zero, zero, zero > 0, motion)


def told(x=0.048, seen=True) -> Motion:
    return Motion(jnp.float32(x), jnp.float32(0), jnp.float32(0.01), jnp.eye(3) * 1e-8, jnp.bool_(seen))


def stepped(agent):
    """After one command, by odometry."""
    belief = predict(agent.belief, *MOVED, VARIANCES)
    return replace(anchor_after_odometry(agent, MOVED, VARIANCES), belief=belief)


@pytest.mark.parametrize("seen", [True, False])
def test_motion_between_views_takes_the_place_of_odometry(arena, seen):
    _, agent, setup = begin(arena, "visual")
    apply, view = jax.jit(localise), blank_view(setup)
    first = apply(agent, view, sightings_of(arena, told()), setup)  # before the first view none was moved from
    np.testing.assert_array_equal(first.belief.pose.x, agent.belief.pose.x)
    assert first.anchor.some
    moved = stepped(first)
    after = apply(moved, view, sightings_of(arena, told(seen=seen)), setup)
    yaw = float(arena.start_xyyaw[2])
    gone = float(after.belief.pose.x - agent.belief.pose.x)
    assert gone == pytest.approx((0.048 if seen else 0.05) * np.cos(yaw), abs=1e-4)
    assert (after.belief.cov[2, 2] < moved.belief.cov[2, 2] - 5e-5) == seen


@pytest.mark.parametrize("way", ["odometry", "icp"])
def test_nothing_in_view_leaves_dead_reckoning(arena, way):
    _, agent, setup = begin(arena, way)
    moved = stepped(agent)
    after = jax.jit(localise)(moved, blank_view(setup), sightings_of(arena), setup)
    for a, b in zip(jax.tree.leaves(after.belief), jax.tree.leaves(moved.belief), strict=True):
        np.testing.assert_array_equal(a, b)
    assert (after.outlines is None) == (way == "odometry") and after.anchor is None


def test_ray_cast_sensor_has_no_landmarks_then(arena):
    for way in WAYS:
        world, agent, setup = begin(arena, way)
        seen = sightings_without_landmarks(blank_view(setup), world, agent, setup, jnp.uint32(1))
        assert not np.any(seen.seen)
        assert (seen.motion is None) == (way in ("odometry", "icp"))
        assert seen.motion is None or not seen.motion.seen


def test_oracle_knows_its_pose_whatever_it_is_told():
    assert kind("visual", sensor="oracle")[1].localisation == "landmarks"
    assert kind("both")[1].localisation == "both"


def test_names_of_views_follow_each_other(arena):
    """A view is asked for, after the next command, by the name that it was kept under."""
    world, agent, setup = begin(arena, "visual")
    batch = lambda *trees: jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], trees)  # noqa: E731
    now, then = view_names(*batch(world, agent))
    assert not np.any(then)
    after = localise(agent, blank_view(setup), sightings_of(arena, told(seen=False)), setup)
    after = replace(after, look=~after.look)  # how the next one is held is not how this one was
    place = Pose(world.pose.x + 0.05, world.pose.y, world.pose.z, world.pose.yaw)
    world = replace(world, pose=place, before=world.pose, decisions=world.decisions + 1)
    later, asked = view_names(*batch(world, after))
    np.testing.assert_array_equal(asked, now)
    assert np.any(later != now)


def plain(arena):
    """The same without any texture, and without landmarks."""
    boxes = replace(arena.boxes, contrast=jnp.zeros_like(arena.boxes.contrast))
    marks = replace(arena.landmarks, used=jnp.zeros_like(arena.landmarks.used))
    return replace(arena, boxes=boxes, landmarks=marks, floor_contrast=jnp.float32(0))


@pytest.mark.slow
@pytest.mark.parametrize(("sensor", "way"), [("raycast", "both"), ("stereo", "visual")])
def test_missions_where_nothing_can_be_seen_end(arena, sensor, way):
    """Without texture nothing is measured: no path is found, and the numbers stay numbers."""
    params, spec = kind(way, sensor=sensor)
    rig = rig_for(MissionConfig(localisation=way, sensor=sensor))
    world = run_bare(MissionSetup(plain(arena), params, spec), from_key(jax.random.key(0)), rig)
    if rig:
        rig.close()
    assert world.code[0] in (Code.NO_PATH, Code.REACHED, Code.COLLIDED, Code.OUT_OF_STEPS)
    assert np.isfinite(world.pose_error[0] + world.yaw_error[0])


@pytest.mark.slow
@pytest.mark.parametrize(("way", "middle"), [("odometry", 0.05), ("visual", 0.01), ("icp", 0.03), ("both", 0.01)])
def test_missions_go_by_each_way(arena, way, middle):
    """Sixteen missions of experiment 1 arrive, and half of them know where they stand within `middle` [m].

    `middle` is about twice the median of 300 random arenas (`sweeps/studies/localisation.py`).
    """
    params, spec = kind(way)
    batch = jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, (SEEDS, *jnp.shape(leaf))), arena)
    noise = jnp.stack([from_key(jax.random.key(seed)) for seed in range(SEEDS)])
    found = run_all(Workload(batch, noise, stack([params]), SEEDS, spec), lambda _: None, workers=1, slots=SEEDS)
    assert np.all(np.asarray(found.code) == Code.REACHED)
    assert np.median(found.pose_error) < middle
    if way in ("visual", "both"):  # nothing bounds the drift of the others
        assert np.max(found.pose_error) < 0.06
