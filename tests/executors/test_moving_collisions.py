"""Obstacles that move against the robot, by fine time steps in NumPy."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.arenas.moving_boxes import Movers
from jaxbiped.executors.execution import Execution
from jaxbiped.executors.moving_collisions import CHECKS, hits_moving_box
from jaxbiped.executors.world_state import Planned, WorldState
from jaxbiped.geometry.pose import Pose
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import MissionConfig
from jaxbiped.motion.primitives import Command
from tests.sensing.scenes import SLOTS, make

PARAMS = MissionConfig().params("full")
RADIUS, MEASURE = float(PARAMS.limits.body_radius), float(PARAMS.durations.measure)
MET = jax.jit(hits_moving_box)
HALF = 0.05  # [m] of the box


def slots(value):
    return jnp.asarray(np.pad(np.array([value], np.float32), (0, SLOTS - 1)))


def situation(way, speed, walk, time=0.0, top=0.5, bottom=0.0, duration=16.0, squat=False):
    """One box of 10 cm that goes from `way[0]` towards `way[1]`, and a robot that walks from `walk[0]` to `walk[1]`."""
    (x0, y0), (x1, y1) = way
    movers = Movers(slots(x1 - x0), slots(y1 - y0), slots(speed), slots(0.0))
    arena = replace(make([(x0, y0, 0.0, HALF, HALF, bottom, top)]), movers=movers)
    arena = jax.tree.map(jnp.asarray, arena)
    zero, whole, no = jnp.zeros(()), jnp.zeros((), jnp.int32), jnp.zeros((), bool)
    before, after = (Pose(jnp.float32(x), jnp.float32(y), zero, zero) for x, y in walk)
    code = jnp.int32(Code.RUNNING)
    world = WorldState(
        before, no, zero, jnp.float32(time), whole, whole, code, jnp.uint32(0), zero, zero, Planned(zero, whole, zero)
    )
    command = Command(turn=zero, primitive=whole, length=zero, rise=whole, squat=jnp.array(squat), left=zero)
    executed = Execution(after, jnp.zeros(3), jnp.zeros(3), jnp.float32(duration), zero, no, no, no)
    return arena, world, command, executed, PARAMS


def nearest(way, speed, walk, time=0.0, duration=16.0, steps=20_000):
    """[m] least distance between the robot's axis and the box, by small steps."""
    t = np.linspace(0.0, MEASURE + duration, steps)
    (x0, y0), (x1, y1) = way
    length = np.hypot(x1 - x0, y1 - y0)
    gone = speed * (time + t) / length
    part = np.where(gone % 2 < 1, gone % 2, 2 - gone % 2)
    along = np.clip((t - MEASURE) / duration, 0, 1)
    x, y = (a + along * (b - a) for a, b in zip(*walk, strict=True))
    dx = np.maximum(abs(x - (x0 + part * (x1 - x0))) - HALF, 0)
    dy = np.maximum(abs(y - (y0 + part * (y1 - y0))) - HALF, 0)
    return np.hypot(dx, dy).min()


def test_random_encounters_as_by_small_steps():
    rng, kinds = np.random.default_rng(0), set()
    for _ in range(150):
        way, walk = rng.uniform(0.3, 1.1, (2, 2)), [rng.uniform(0.4, 1.0, 2)] * 2
        walk = [walk[0], walk[0] + rng.uniform(-0.07, 0.07, 2)]
        speed, time = rng.uniform(0, 0.03), rng.uniform(0, 200)
        gap = nearest(way, speed, walk, time) - RADIUS
        # Between two checks a gap closes by less than this.
        slack = (speed * (MEASURE + 16.0) + np.hypot(*(walk[1] - walk[0]))) / (CHECKS - 1)
        if abs(gap) > slack:
            found = bool(MET(*situation(way, speed, walk, time)))
            assert found == (gap < 0)
            kinds.add(found)
    assert kinds == {True, False}


HEAD_ON = {"way": ((0.9, 0.7), (0.3, 0.7)), "speed": 0.02, "walk": ((0.5, 0.7), (0.55, 0.7))}


@pytest.mark.parametrize(
    ("change", "meets"),
    [
        ({}, True),
        ({"speed": 0.001}, False),
        ({"top": 0.03}, False),  # as high as a step
        ({"bottom": 0.37}, True),  # the head, standing
        ({"bottom": 0.37, "squat": True}, False),
        ({"duration": 0.0}, True),  # it comes while the robot measures, or at once after
        ({"way": ((0.9, 0.7), (0.9, 0.7))}, False),  # goes nowhere
    ],
)
def test_who_is_met(change, meets):
    if change.get("duration") == 0.0:
        change = change | {"way": ((0.7, 0.7), (0.3, 0.7))}
    assert bool(MET(*situation(**(HEAD_ON | change)))) == meets


def test_an_arena_that_stands_meets_nobody():
    arena, *rest = situation(**HEAD_ON)
    assert not bool(hits_moving_box(replace(arena, movers=None), *rest))
