"""Missions for tests. One program, one number of slots, arenas, points and jobs: compiled once a session."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.arenas.families import FAMILIES, SIZE_X, SIZE_Y
from jaxbiped.core.names import STRATEGIES
from jaxbiped.executors.world_state import WorldState
from jaxbiped.mission.arena_batch import draw
from jaxbiped.mission.batched_driver import Jobs, compile_queue, stack
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import MissionConfig, mission_spec
from jaxbiped.mission.recorded_driver import turn_once
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.state import start
from jaxbiped.motion.primitives import Command
from jaxbiped.sensing import PRESETS
from tests.mission.replay import Moment

ARENAS, POINTS, JOBS, SLOTS = 32, 16, 32, 8
CONFIG = MissionConfig()
SPEC = mission_spec(CONFIG, (SIZE_X, SIZE_Y))
REAL = MissionConfig(stereo=PRESETS["real"].stereo, landmarks=PRESETS["real"].landmarks)


def pad(trees, size):
    """A list of pytrees as one, filled up to `size` rows with the first."""
    return stack([*trees, *trees[:1] * (size - len(trees))])


def row(tree, index):
    """Row `index` of every leaf, on the host."""
    return jax.tree.map(lambda leaf: np.asarray(leaf)[index], tree)


def play(arenas, params, seeds, spec=SPEC, slots=SLOTS):
    """Mission k in arena k under parameters k by the compiled queue; lists of at most JOBS, results [k]."""
    count = len(arenas)
    points = list({id(setting): setting for setting in params}.values())
    point = [next(p for p, q in enumerate(points) if q is setting) for setting in params]
    fill = [0] * (JOBS - count)
    jobs = Jobs(
        np.array([*range(count), *fill], np.int32),
        np.array([*point, *fill], np.int32),
        np.array([*seeds, *fill], np.uint32),
        jnp.int32(count),
    )
    setup = MissionSetup(pad(arenas, ARENAS), pad(points, POINTS), spec)
    arguments = jax.tree.map(jnp.asarray, (setup, jobs))
    work = compile_queue(*arguments, slots)
    return row(jax.device_get(work(*arguments, lambda ended: None)), slice(count))


@dataclass(frozen=True)
class Log:
    """`T` decisions of one mission, and its end."""

    classes: np.ndarray  # [T, H, W]
    levels: np.ndarray  # [T, H, W]
    votes: np.ndarray  # [T, H, W, 4]
    command: Command  # leaves [T]
    moments: tuple[Moment, ...]  # [T]
    world: WorldState  # at the end


def step_through(arena, setting, seed, spec=SPEC) -> Log:
    """One mission by a Python loop over `step`, alone in its batch, as the package's recorded driver has it."""
    setup = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], MissionSetup(arena, setting, spec))
    world, agent = compiled_start(setup, jnp.asarray([seed]))
    taken, moments = [], []
    while world.code[0] == Code.RUNNING:
        before = world, agent.look
        world, agent, view, command, thought = turn_once(world, agent, setup)
        taken.append(row((thought.classes, thought.levels, agent.grid_map.votes, command), 0))
        after = view, thought.pose, agent.grid_map, thought.classes, thought.levels, thought.problem.start_ij
        moments.append(Moment(*row((*before, *after), 0)))
    return Log(*stack(taken), tuple(moments), row(world, 0))


compiled_start = jax.jit(jax.vmap(start))


@pytest.fixture(scope="session")
def population():
    """24 random arenas of all families under all strategies, half of them with the noise of real cameras.

    (arenas, parameters, seeds, names of the strategies), lists of equal length.
    """
    arenas, seeds = jax.device_get(draw(jax.random.key(5), jnp.arange(24), FAMILIES))
    named = [{name: jax.device_get(c.params(name)) for name in STRATEGIES} for c in (CONFIG, REAL)]
    names = [list(STRATEGIES)[(k + k // 6) % 5] for k in range(24)]
    params = [named[k // 2 % 2][name] for k, name in enumerate(names)]
    return [row(arenas, k) for k in range(24)], params, list(seeds), names


@pytest.fixture(scope="session")
def played(population):
    """The population's missions by the queue."""
    return play(*population[:3])


@pytest.fixture(scope="session")
def stepped(population):
    """The population's missions by the recorded driver: a log each."""
    return [step_through(*each) for each in zip(*population[:3], strict=True)]
