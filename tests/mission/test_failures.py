"""Each code in a scene that is built for it, and the referee against plain Python."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.arenas.scene import SceneConfig, to_arena
from jaxbiped.executors.kinematic_executor import kinematic
from jaxbiped.executors.world_state import Planned, WorldState
from jaxbiped.geometry.boxes import ground_height
from jaxbiped.geometry.pose import Pose
from jaxbiped.mission.batched_driver import stack
from jaxbiped.mission.mission_step import apply_outcome
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.state import start
from jaxbiped.motion.primitives import Command, Primitive
from jaxbiped.sensing.counter_rng import fold
from tests.mission.conftest import CONFIG, SPEC, play, row
from tests.reference import motion as plain

WALL = {"centre": (0.9, 0.7), "size": (0.1, 1.4), "top": 0.5}
CLOSED = (  # walls 25 cm around the start
    {"centre": (0.4, 0.42), "size": (0.6, 0.05), "top": 0.5},
    {"centre": (0.4, 0.98), "size": (0.6, 0.05), "top": 0.5},
    {"centre": (0.68, 0.7), "size": (0.05, 0.6), "top": 0.5},
    {"centre": (0.12, 0.7), "size": (0.05, 0.6), "top": 0.5},
)


def scene(*boxes, start=(0.4, 0.7, 0.0), goal=(1.4, 0.7)):
    config = {"name": "test", "start": start, "goal": goal, "boxes": boxes}
    return jax.device_get(to_arena(SceneConfig.model_validate(config)))


def limited(setting, **limits):
    return replace(setting, limits=replace(setting.limits, **limits))


CASES = {  # name: (arena, strategy, code)
    "reached_at_once": (scene(goal=(0.45, 0.7)), "full", Code.REACHED),
    "reached": (scene(), "full", Code.REACHED),
    "no_path": (scene(*CLOSED), "full", Code.NO_PATH),
    "stuck": (scene(WALL), "blind_stop", Code.STUCK),
    "collided": (scene({**WALL, "contrast": 0.0}), "full", Code.COLLIDED),
    "fell": (scene({**WALL, "size": (0.4, 1.4), "top": 0.03, "contrast": 0.0}), "full", Code.FELL),
    "out_of_steps": (scene(), "short", Code.OUT_OF_STEPS),
    "invalid": (replace(scene(), start_xyyaw=np.float32([np.nan, 0.7, 0.0])), "full", Code.INVALID),
    "invalid_goal": (replace(scene(), goal_xy=np.float32([np.inf, 0.7])), "full", Code.INVALID),
}


@pytest.fixture(scope="module")
def outcomes():
    named = {name: jax.device_get(CONFIG.params(name)) for name in ("full", "blind_stop")}
    named["short"] = limited(named["full"], max_decisions=np.int32(3))
    arenas = [arena for arena, _, _ in CASES.values()]
    return play(arenas, [named[name] for _, name, _ in CASES.values()], [7] * len(arenas))


@pytest.mark.parametrize("name", CASES)
def test_code(outcomes, name):
    result = row(outcomes, list(CASES).index(name))
    assert Code(int(result.code)) == CASES[name][2]
    if name in ("reached_at_once", "invalid", "invalid_goal"):
        assert result.decisions == result.time == result.distance == 0
    if name == "out_of_steps":
        assert result.decisions == 3
    if name == "stuck":  # before the wall, its inflated side and at most two cells of caution
        assert 0.2 < result.distance < 0.4
    if name == "no_path":  # it never left the walls
        assert result.distance < 0.5 and result.decisions < 20


def test_out_of_bounds():
    arena, setting = to_device(scene()), to_device(CONFIG.params("full"))
    setup = MissionSetup(arena, setting, SPEC)
    world, agent = start(setup, jnp.uint32(1))
    world = replace(world, pose=replace(world.pose, x=jnp.float32(1.77)))
    step = Command(
        jnp.float32(0), jnp.int32(Primitive.STRAIGHT_FORWARD), jnp.float32(0.05), jnp.int32(0), jnp.array(False)
    )
    done = kinematic(arena, world, step, setting)
    assert bool(done.outside)
    after, _ = apply_outcome(world, agent, step, jnp.int32(Code.RUNNING), done, setup)
    assert after.code == Code.OUT_OF_BOUNDS
    stopped, _ = apply_outcome(world, agent, step, jnp.int32(Code.NO_PATH), done, setup)
    assert stopped.code == Code.NO_PATH and stopped.pose.x == world.pose.x and stopped.distance == 0


def to_device(tree):
    return jax.tree.map(jnp.asarray, tree)


PLACES = 400  # random poses and commands, near enough to things that most of them end badly


def test_referee_is_that_of_the_reference(population):
    rng = np.random.default_rng(3)
    arenas = [population[0][k] for k in range(24)]
    setting = jax.device_get(CONFIG.params("full"))
    which = rng.integers(0, 24, PLACES)
    x, y, yaw = rng.uniform(0.02, 1.78, PLACES), rng.uniform(0.02, 1.38, PLACES), rng.uniform(-3.1, 3.1, PLACES)
    rise, squat = rng.integers(-1, 2, PLACES), rng.random(PLACES) < 0.3
    primitive = np.select([squat, rise > 0, rise < 0], [4, 2, 3], 1)
    turn, length = rng.normal(0, 0.8, PLACES), rng.uniform(0.02, 0.1, PLACES)
    command = Command(
        jnp.asarray(turn, jnp.float32),
        jnp.asarray(primitive, jnp.int32),
        jnp.asarray(length, jnp.float32),
        jnp.asarray(rise, jnp.int32),
        jnp.asarray(squat),
        jnp.zeros(PLACES),
    )
    batch = to_device(stack([arenas[k] for k in which]))
    x, y, yaw = (jnp.asarray(v, jnp.float32) for v in (x, y, yaw))
    z = jax.vmap(ground_height)(batch.boxes, x, y)
    zero = jnp.zeros(PLACES)
    none = jnp.zeros(PLACES, jnp.int32)
    seed = jnp.asarray(rng.integers(0, 2**32, PLACES, dtype=np.uint32))
    world = WorldState(
        Pose(x, y, z, yaw),
        jnp.asarray(squat),
        zero,
        zero,
        none,
        none,
        none - 1,
        seed,
        zero,
        zero,
        Planned(zero, none, zero),
    )
    ours = jax.device_get(jax.jit(jax.vmap(kinematic, in_axes=(0, 0, 0, None)))(batch, world, command, setting))
    world, command = jax.device_get((world, command))
    differ, seen = 0, {"collided": 0, "fell": 0, "outside": 0}
    for k in range(PLACES):
        theirs = plain.kinematic(arenas[which[k]], row(world, k), row(command, k), setting)
        mine = row(ours, k)
        np.testing.assert_allclose((mine.pose.x, mine.pose.y, mine.pose.yaw), np.delete(theirs.pose, 2), atol=2e-6)
        np.testing.assert_allclose(mine.moved, theirs.moved, atol=1e-6)
        np.testing.assert_allclose(mine.variances, theirs.variances, rtol=1e-5)
        np.testing.assert_allclose(mine.time, theirs.time, rtol=1e-5)
        verdicts = [bool(getattr(mine, name)) == bool(getattr(theirs, name)) for name in seen]
        differ += not all(verdicts) or abs(mine.pose.z - theirs.pose[2]) > 1e-6
        for name in seen:
            seen[name] += bool(getattr(theirs, name))
    assert differ <= 1  # a place within 1e-7 m of a box's edge
    assert min(seen.values()) > 5, seen


@pytest.mark.parametrize(("squat", "clearance", "hit"), [(False, 0.37, True), (True, 0.37, False), (True, 0.335, True)])
def test_lintel_hits_who_stands(squat, clearance, hit):
    arena = to_device(scene({"centre": (0.9, 0.7), "size": (0.05, 0.6), "bottom": clearance, "top": 0.5}))
    setting = to_device(CONFIG.params("full"))
    world, _ = start(MissionSetup(arena, setting, SPEC), jnp.uint32(1))
    world = replace(world, pose=replace(world.pose, x=jnp.float32(0.8)))
    step = Command(jnp.float32(0), jnp.int32(Primitive.PASS_GATE), jnp.float32(0.05), jnp.int32(0), jnp.array(squat))
    assert bool(kinematic(arena, world, step, setting).collided) == hit


ON_FLOOR = [(0, 0.05, True), (0, 0.0, False), (-1, 0.05, True)]
STEPS_UP = [(1, 0.05, False), (1, 0.01, False), (1, -0.01, False), (1, -0.03, True)]


@pytest.mark.parametrize(("rise", "ahead", "fell"), ON_FLOOR + STEPS_UP)
def test_edge_may_lie_off_by_the_tolerance_but_no_more(rise, ahead, fell):
    """A bump of 3 cm from x = 0.70 on; the robot steps from before it to `ahead` beyond its edge."""
    arena = to_device(scene({"centre": (0.9, 0.7), "size": (0.4, 1.4), "top": 0.03}))
    setting = to_device(CONFIG.params("full"))
    world, _ = start(MissionSetup(arena, setting, SPEC), jnp.uint32(1))
    world = replace(world, pose=replace(world.pose, x=jnp.float32(0.66)))
    step = Command(
        jnp.float32(0), jnp.int32(2 if rise > 0 else 1), jnp.float32(0.04 + ahead), jnp.int32(rise), jnp.array(False)
    )
    done = kinematic(arena, world, step, setting)
    assert bool(done.fell) == fell and not bool(done.collided)


def test_noise_of_odometry_is_that_of_mission_and_decision():
    arena, setting = to_device(scene()), to_device(CONFIG.params("full"))
    world, _ = start(MissionSetup(arena, setting, SPEC), jnp.uint32(1))
    step = Command(jnp.float32(0.1), jnp.int32(1), jnp.float32(0.05), jnp.int32(0), jnp.array(False))
    moved = [
        np.asarray(kinematic(arena, replace(world, decisions=jnp.int32(n), seed=seed), step, setting).moved)
        for n, seed in ((0, jnp.uint32(1)), (1, jnp.uint32(1)), (0, fold(jnp.uint32(1), 1)), (0, jnp.uint32(1)))
    ]
    assert not np.allclose(moved[0], moved[1]) and not np.allclose(moved[0], moved[2])
    np.testing.assert_array_equal(moved[0], moved[3])
