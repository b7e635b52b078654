"""Missions for tests. One program, one number of slots, arenas, settings and jobs: compiled once a session."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.arenas.families import FAMILIES, SIZE_X, SIZE_Y
from jaxbiped.mission.cycle import cycle
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.queue import Jobs, compile_queue, stack
from jaxbiped.mission.settings import MissionConfig, program
from jaxbiped.mission.state import start
from jaxbiped.mission.strategies import STRATEGIES
from jaxbiped.sensing import PRESETS
from jaxbiped.study.evaluate import draw

ARENAS, SETTINGS, JOBS, SLOTS = 32, 16, 32, 8
CONFIG = MissionConfig()
PROGRAM = program(CONFIG, (SIZE_X, SIZE_Y))
REAL = MissionConfig(stereo=PRESETS["real"].stereo, landmarks=PRESETS["real"].landmarks)


def pad(trees, size):
    """A list of pytrees as one, filled up to `size` rows with the first."""
    return stack([*trees, *trees[:1] * (size - len(trees))])


def row(tree, index):
    """Row `index` of every leaf, on the host."""
    return jax.tree.map(lambda leaf: np.asarray(leaf)[index], tree)


def play(arenas, settings, seeds, program=PROGRAM, slots=SLOTS):
    """Mission k in arena k under settings k by the compiled queue; lists of at most JOBS, results [k]."""
    count = len(arenas)
    points = list({id(setting): setting for setting in settings}.values())
    point = [next(p for p, q in enumerate(points) if q is setting) for setting in settings]
    fill = [0] * (JOBS - count)
    jobs = Jobs(
        np.array([*range(count), *fill], np.int32),
        np.array([*point, *fill], np.int32),
        np.array([*seeds, *fill], np.uint32),
        jnp.int32(count),
    )
    arguments = jax.tree.map(jnp.asarray, (pad(arenas, ARENAS), pad(points, SETTINGS), jobs))
    work = compile_queue(*arguments, program, slots)
    return row(jax.device_get(work(*arguments, lambda ended: None)), slice(count))


@dataclass(frozen=True)
class Log:
    """`T` decisions of `B` missions, and their end."""

    running: np.ndarray  # [T, B] the mission had not ended before this decision
    classes: np.ndarray  # [T, B, H, W]
    levels: np.ndarray  # [T, B, H, W]
    votes: np.ndarray  # [T, B, H, W, 4]
    command: object  # leaves [T, B]
    world: object  # [B]


@cache
def compiled_cycle(program):
    return jax.jit(partial(cycle, program=program))


def step_through(arenas, settings, seeds, program=PROGRAM, batch=JOBS) -> Log:
    """The same missions by a Python loop over `cycle`, all side by side."""
    count = len(arenas)
    arena, setting = (jax.tree.map(jnp.asarray, pad(trees, batch)) for trees in (arenas, settings))
    seed = jnp.asarray(np.array([*seeds, *seeds[:1] * (batch - count)], np.uint32))
    begin = jax.jit(jax.vmap(partial(start, spec=program.spec)))
    world, mind = begin(arena, setting, seed)
    moments = []
    while np.any(np.asarray(world.code)[:count] == Code.RUNNING):
        running = np.asarray(world.code) == Code.RUNNING
        world, mind, _, command, thought = compiled_cycle(program)(world, mind, arena, setting)
        moment = running, thought.classes, thought.levels, mind.grid_map.votes, command
        moments.append(row(moment, slice(count)))
    return Log(*stack(moments), row(world, slice(count)))


@pytest.fixture(scope="session")
def population():
    """24 random arenas of all families under all strategies, half of them with the noise of real cameras.

    (arenas, settings, seeds, names of the strategies), lists of equal length.
    """
    arenas, seeds = jax.device_get(draw(jax.random.key(5), jnp.arange(24), FAMILIES))
    named = [{name: jax.device_get(c.settings(name)) for name in STRATEGIES} for c in (CONFIG, REAL)]
    names = [list(STRATEGIES)[(k + k // 6) % 5] for k in range(24)]
    settings = [named[k // 2 % 2][name] for k, name in enumerate(names)]
    return [row(arenas, k) for k in range(24)], settings, list(seeds), names


@pytest.fixture(scope="session")
def played(population):
    """The population's missions by the queue."""
    return play(*population[:3])


@pytest.fixture(scope="session")
def stepped(population):
    """The population's missions by the stepped driver."""
    return step_through(*population[:3])
