"""Missions of simulated bipeds: in the closed loop, independent of each other, and told as they are."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.arenas.scene import BoxConfig, SceneConfig, load_scene, to_arena
from jaxbiped.errors import InputError
from jaxbiped.geometry.pose import Pose
from jaxbiped.mission.batched_driver import Jobs, stack
from jaxbiped.mission.metrics import Energy
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import MissionConfig, mission_spec
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.simulated_driver import walk, walk_logged
from jaxbiped.mission.simulated_step import PlanEnd, execute
from jaxbiped.mission.state import start
from jaxbiped.motion.primitives import Command
from jaxbiped.sensing.config import CameraConfig

SIZE = (0.9, 0.6)
CONFIG = MissionConfig(executor="native", camera=CameraConfig(columns=32, rows=24), walk={"threads": 1})
SPEC = mission_spec(CONFIG, SIZE)
PARAMS = replace(CONFIG.params("full"), metrics=(Energy(),))
MARKS = ({"kind": "circle", "at": (0.85, 0.1)}, {"kind": "circle", "at": (0.85, 0.5)})


def arena(start, goal, *boxes):
    scene = SceneConfig(name="small", size=SIZE, start=start, goal=goal, landmarks=MARKS, boxes=boxes)
    return to_arena(scene)


AHEAD = arena((0.25, 0.3, 0.0), (0.5, 0.3))
ASIDE = arena((0.3, 0.2, 0.0), (0.3, 0.4))  # turns first
BUMP = arena((0.25, 0.3, 0.0), (0.70, 0.3), BoxConfig(centre=(0.6, 0.3), size=(0.4, 0.6), top=0.03))
ARENAS = [AHEAD, ASIDE, BUMP]


def play(which, slots, config=CONFIG, observer=None):
    """Missions k in arenas `which`, with seed k."""
    arenas, params = (jax.tree.map(jnp.asarray, stack(trees)) for trees in (ARENAS, [PARAMS]))
    count = len(which)
    jobs = Jobs(np.array(which), np.zeros(count, int), np.array(which, np.uint32), jnp.int32(count))
    walking = config.walk.model_copy(update={"slots": slots})
    return walk(MissionSetup(arenas, params, mission_spec(config, SIZE)), jobs, walking, observer=observer)


@pytest.fixture(scope="module")
def together():
    """All three at once, each a slot."""
    return play([0, 1, 2], 3)


def test_they_reach_their_goals(together):
    assert [Code(code) for code in together.code] == [Code.REACHED] * 3
    assert np.all(together.goal_distance <= 0.1)
    assert np.all(together.distance > 0.05)
    assert np.all(together.time >= 10.0 * together.measurements)


def test_their_servos_work(together):
    (work,) = together.metrics
    assert np.all(work > 1.0) and work[2] == max(work)  # [J]; the last one has the longest way, over a bump


@pytest.mark.parametrize("k", [0, 1, 2])
def test_one_alone_does_the_same_bit_for_bit(together, k):
    alone = play([k], 1)
    for one, all_of_them in zip(jax.tree.leaves(alone), jax.tree.leaves(together), strict=True):
        np.testing.assert_array_equal(one[0], all_of_them[k])


def test_fewer_slots_and_another_order_do_the_same(together):
    order = [2, 0, 1]
    queued = play(order, 2)
    for one, other in zip(jax.tree.leaves(queued), jax.tree.leaves(together), strict=True):
        np.testing.assert_array_equal(one, other[order])


def test_nobody_waits_for_another():
    """The straight walker has decided again before the one that turns by 90 degrees has ended its first command."""

    class Watch:
        def __init__(self):
            self.turns = []

        def decided(self, job, *_):
            self.turns.append(job)

        def concluded(self, *_):
            pass

        def moved(self, *_):
            pass

    watch = Watch()
    play([0, 1], 2, observer=watch)
    second = [k for k, job in enumerate(watch.turns) if job == 1][1]
    assert watch.turns[:second].count(0) >= 3


def test_logged_mission_is_that_of_the_queue(together):
    seen = []
    mission = walk_logged(MissionSetup(BUMP, PARAMS, SPEC), jnp.uint32(2), CONFIG.walk, seen.append)
    assert mission.code == together.code[2]
    assert mission.distance == together.distance[2]
    assert mission.time == mission.played[-1].time == together.time[2]
    assert tuple(seen) == mission.played
    assert "Step-up-bump" in [played.name for played in mission.played]
    assert len(mission.log.time) == len(mission.played) + 1
    assert mission.log.outcome == "reached"


def test_a_wall_that_cannot_be_seen_is_a_collision():
    plain = arena((0.25, 0.3, 0.0), (0.75, 0.3), BoxConfig(centre=(0.5, 0.3), size=(0.1, 0.6), top=0.4, contrast=0.0))
    mission = walk_logged(MissionSetup(plain, PARAMS, SPEC), jnp.uint32(0), CONFIG.walk)
    assert mission.code == Code.COLLIDED
    assert 0.05 < mission.distance < 0.25


def test_a_hole_that_cannot_be_seen_is_a_fall():
    """A robot on a plain table, whose edge no camera measures, walks over it."""
    table = arena((0.25, 0.3, 0.0), (0.75, 0.3), BoxConfig(centre=(0.2, 0.3), size=(0.4, 0.6), top=0.12, contrast=0.0))
    mission = walk_logged(MissionSetup(table, PARAMS, SPEC), jnp.uint32(0), CONFIG.walk)
    assert mission.code == Code.FELL


def test_a_mission_that_is_over_before_it_began():
    there = arena((0.3, 0.3, 0.0), (0.35, 0.3))
    mission = walk_logged(MissionSetup(there, PARAMS, SPEC), jnp.uint32(0), CONFIG.walk)
    assert (mission.code, mission.distance, mission.played) == (Code.REACHED, 0.0, ())


def test_odometry_counts_what_really_happened():
    world, _ = start(MissionSetup(AHEAD, PARAMS, SPEC), jnp.uint32(0))
    after = Pose(*(jnp.float32(v) for v in (0.30, 0.31, 0.0, 0.2)))
    no = jnp.zeros((), bool)
    command = Command(jnp.float32(0), jnp.int32(1), jnp.float32(0.05), jnp.int32(0), no, jnp.float32(0))
    params = replace(PARAMS, odometry=jax.tree.map(jnp.zeros_like, PARAMS.odometry))  # exact
    setup = MissionSetup(AHEAD, params, SPEC)
    executed = execute(world, command, PlanEnd(after, no, no), setup)
    np.testing.assert_allclose(executed.moved, [0.05, 0.01, 0.2], atol=1e-6)
    assert float(executed.distance) == pytest.approx(np.hypot(0.05, 0.01))
    assert float(executed.time) == 16.0  # Table 2's
    assert not bool(executed.outside)
    beyond = replace(after, x=jnp.float32(SIZE[0] + 0.01))
    assert bool(execute(world, command, PlanEnd(beyond, no, no), setup).outside)


def test_a_gpu_that_is_not_there_is_an_input_error():
    if any(device.platform == "gpu" for device in jax.devices()):
        pytest.skip("a GPU is there")
    config = MissionConfig(executor="mjx", walk={"device": "gpu"}, camera=CONFIG.camera)
    with pytest.raises(InputError, match="no such device"):
        play([0], 1, config)


@pytest.mark.slow
def test_mjx_reaches_the_goals_too(together):
    config = MissionConfig(executor="mjx", camera=CONFIG.camera)
    result = play([0, 1, 2], 3, config)
    np.testing.assert_array_equal(result.code, together.code)
    np.testing.assert_allclose(result.distance, together.distance, atol=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2, 3, 4, 5, 6])
def test_the_papers_experiments_are_solved_without_a_fall_or_a_touch(number, request):
    _, scene = load_scene(request.config.rootpath / f"configs/scenes/experiment_{number}.toml")
    config = MissionConfig(executor="native")
    params = config.params("floor_only" if number == 4 else "full")
    spec = mission_spec(config, tuple(round(float(v), 6) for v in scene.size_xy))
    assert walk_logged(MissionSetup(scene, params, spec), jnp.uint32(0), config.walk).code == Code.REACHED
