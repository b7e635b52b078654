"""Routes over headings: on a map that is known, a plan takes as long as the mission that follows it."""

import math
from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped import planning
from jaxbiped.arenas.families import FAMILIES
from jaxbiped.geometry.pose import Pose
from jaxbiped.mapping import Cell, truth_grid
from jaxbiped.mission.decision import nearest_direction
from jaxbiped.mission.goal import goal_cell
from jaxbiped.mission.route import quickest, route, times_of
from jaxbiped.mission.settings import MissionConfig, program
from jaxbiped.motion.primitives import duration
from jaxbiped.motion.selection import cell_of, select
from jaxbiped.study.evaluate import draw
from tests.mission.conftest import CONFIG, PROGRAM

B, MOST = 24, 70  # maps, decisions
HEADING = replace(PROGRAM, planner="heading")
SECONDS = 0.5  # of a mission: rounding, and turns too small to be played


@pytest.fixture(scope="module")
def settings():
    return CONFIG.settings("full")


@partial(jax.jit, static_argnames="static")
def turn(x, y, yaw, time, classes, levels, goal_ij, settings, static):
    """One decision of each robot that is not in its goal's cell, on a map that it knows; it moves as it is told."""
    spec = static.spec
    ij = jax.vmap(cell_of, in_axes=(0, 0, None))(x, y, spec)
    heading = jax.vmap(nearest_direction)(yaw)
    _, directions = route(classes, levels, goal_ij, ij, heading, yaw, settings, static)
    command = jax.vmap(select, in_axes=(0, 0, 0, 0, 0, None, None))(
        Pose(x, y, jnp.zeros_like(x), yaw), ij, jnp.maximum(directions, 0), classes, levels, jnp.bool_(False), spec
    )
    goes = jnp.any(ij != goal_ij, axis=1) & (directions[:, 0] >= 0)
    facing = yaw + command.turn
    spent = duration(command, settings.durations) + settings.durations.measure
    return (
        jnp.where(goes, x + command.length * jnp.cos(facing), x),
        jnp.where(goes, y + command.length * jnp.sin(facing), y),
        jnp.where(goes, facing, yaw),
        jnp.where(goes, time + spent, time),
    )


def drive(classes, levels, start_xyyaw, goal_ij, settings, static=HEADING):
    """(planned, taken) [s] of each robot until it stands in its goal's cell; NaN for one that does not come to."""
    grids = jnp.asarray(classes), jnp.asarray(levels), jnp.asarray(goal_ij)
    x, y, yaw = jnp.asarray(start_xyyaw, jnp.float32).T
    field = jax.jit(quickest, static_argnums=4)(*grids, settings, HEADING)
    start_ij = jax.vmap(cell_of, in_axes=(0, 0, None))(x, y, static.spec)
    planned = planning.heading_path(field, start_ij, yaw, MOST).cost
    state = x, y, yaw, 0 * x
    for _ in range(MOST):
        state = turn(*state, *grids, settings, static)
    ij = jax.vmap(cell_of, in_axes=(0, 0, None))(*state[:2], static.spec)
    arrived = (np.asarray(ij) == goal_ij).all(1)
    return np.asarray(planned), np.where(arrived, state[3], np.nan)


def scenes():
    """Maps whose edges all run along the grid, from the centre of cell (14, 3) to cell (14, 31), with yaws."""
    classes = np.full((B, *PROGRAM.spec.shape), Cell.FLOOR, np.int8)
    levels = np.zeros_like(classes)
    classes[1, 8:, 10:14] = Cell.OBSTACLE
    classes[2, :, 12:17], levels[2, :, 12:17] = Cell.BUMP, 1
    classes[3, :, 18:21] = Cell.GATE
    classes[4, :14, 20], classes[4, 16:, 20] = Cell.OBSTACLE, Cell.OBSTACLE  # a door
    goal_ij = np.tile([14, 31], (B, 1))
    start = np.tile([3.5 * 0.05, 14.5 * 0.05, 0.0], (B, 1))
    start[5:, 2] = np.linspace(-3, 3, B - 5)
    return classes, levels, start, goal_ij


def test_plan_takes_what_the_clock_counts(settings):
    planned, taken = drive(*scenes(), settings)
    np.testing.assert_allclose(taken, planned, atol=SECONDS)
    assert planned[0] == pytest.approx(28 * 26)
    assert planned[2] == pytest.approx(26 * 26 + 2 * 106) and planned[3] == pytest.approx(24 * 26 + 4 * 58)


def test_plan_in_random_arenas_takes_about_what_the_clock_counts(settings):
    """What is between them: edges at other angles than 45 degrees, and what a step over them leads aside."""
    arenas, _ = draw(jax.random.key(3), jnp.arange(B), FAMILIES)
    spec, rules = PROGRAM.spec, settings.strategy.rules()
    classes, levels = jax.jit(jax.vmap(lambda a: truth_grid(a, spec, settings.body)))(arenas)
    goal_ij = jax.jit(jax.vmap(lambda a, c: goal_cell(a.goal_xy, jnp.float32(0.1), c, rules, spec)))(arenas, classes)
    planned, taken = drive(classes, levels, arenas.start_xyyaw, np.asarray(goal_ij), settings)
    off = (taken - planned)[np.isfinite(planned)] / planned[np.isfinite(planned)]
    assert len(off) > B / 2 and np.isfinite(off).mean() > 0.9
    off = off[np.isfinite(off)]
    assert abs(np.median(off)) < 0.01 and np.quantile(np.abs(off), 0.9) < 0.05


def test_switches():
    assert PROGRAM.planner == "cell" and program(MissionConfig(planner="heading"), (1.8, 1.4)) == HEADING
    for name in ("kinematic", "sampled", "native", "mjx"):
        for placed in (True, False):
            assert program(MissionConfig(executor=name, foot_placement=placed), (1.8, 1.4)).footing == placed


def test_times_are_those_of_the_mission(settings):
    times = times_of(settings)
    assert [float(t) for t in jax.tree.leaves(times)] == [16, 5, 96, 96, 48, 10, 800]  # C4 at 8 s a unit
    assert math.isclose(float(times_of(replace(settings, costs=planning.Costs(c0=3.0, c1=1.0))).unmeasured), 400)
