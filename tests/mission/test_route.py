"""Routes over headings: on a map that is known, a plan takes as long as the mission that follows it."""

import math
from dataclasses import replace
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped import planning
from jaxbiped.arenas import load_scene
from jaxbiped.arenas.families import FAMILIES
from jaxbiped.geometry.pose import Pose
from jaxbiped.mapping import Cell, truth_grid
from jaxbiped.mission.arena_batch import draw
from jaxbiped.mission.goal import goal_cell
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import MissionConfig, mission_spec
from jaxbiped.mission.plan_rollout import follow
from jaxbiped.mission.recorded_driver import run_logged
from jaxbiped.mission.route import pose_problem, times_of
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.motion.local_map import LocalMap
from jaxbiped.motion.selection import cell_of
from jaxbiped.planning.planners import GridPlanner, HeadingPlanner
from tests.mission.conftest import CONFIG, SPEC

B = 24  # maps
SCENE = Path(__file__).parents[2] / "configs" / "scenes" / "experiment_5.toml"
PLANNER = HeadingPlanner()
SECONDS = 0.5  # of a mission: rounding, and turns too small to be played


@pytest.fixture(scope="module")
def params():
    return CONFIG.params("full")


@partial(jax.jit, static_argnames="spec")
def planned_and_taken(classes, levels, start_xyyaw, goal_ij, params, spec):
    """[s] of each plan, and of the robot that follows it."""
    x, y, yaw = start_xyyaw.T
    start_ij = jax.vmap(cell_of, in_axes=(0, 0, None))(x, y, spec.grid)
    begin = LocalMap(classes, levels, start_ij, Pose(x, y, jnp.zeros_like(x), yaw), spec.grid)
    field = PLANNER.field(pose_problem(begin, goal_ij, params, spec))
    planned = planning.heading_path(field, start_ij, yaw, 1).cost
    return planned, follow(begin, goal_ij, params, spec)


def drive(classes, levels, start_xyyaw, goal_ij, params):
    """The same, from NumPy to NumPy."""
    arguments = (jnp.asarray(a) for a in (classes, levels, np.asarray(start_xyyaw, np.float32), goal_ij))
    return map(np.asarray, planned_and_taken(*arguments, replace(params, planner=PLANNER), SPEC))


def scenes():
    """Maps whose edges all run along the grid, from the centre of cell (14, 3) to cell (14, 31), with yaws."""
    classes = np.full((B, *SPEC.grid.shape), Cell.FLOOR, np.int8)
    levels = np.zeros_like(classes)
    classes[1, 8:, 10:14] = Cell.OBSTACLE
    classes[2, :, 12:17], levels[2, :, 12:17] = Cell.BUMP, 1
    classes[3, :, 18:21] = Cell.GATE
    classes[4, :14, 20], classes[4, 16:, 20] = Cell.OBSTACLE, Cell.OBSTACLE  # a door
    goal_ij = np.tile([14, 31], (B, 1))
    start = np.tile([3.5 * 0.05, 14.5 * 0.05, 0.0], (B, 1))
    start[5:, 2] = np.linspace(-3, 3, B - 5)
    return classes, levels, start, goal_ij


def test_plan_takes_what_the_clock_counts(params):
    planned, taken = drive(*scenes(), params)
    np.testing.assert_allclose(taken, planned, atol=SECONDS)
    assert planned[0] == pytest.approx(28 * 26)
    assert planned[2] == pytest.approx(26 * 26 + 2 * 106) and planned[3] == pytest.approx(24 * 26 + 4 * 58)


def test_plan_in_random_arenas_takes_about_what_the_clock_counts(params):
    """What is between them: starts off their cells' centres, and edges at other angles than 45 degrees."""
    arenas, _ = draw(jax.random.key(3), jnp.arange(B), FAMILIES)
    grid, rules = SPEC.grid, params.strategy.rules()
    classes, levels = jax.jit(jax.vmap(lambda a: truth_grid(a, grid, params.body)))(arenas)
    goal_ij = jax.jit(jax.vmap(lambda a, c: goal_cell(a.goal_xy, jnp.float32(0.1), c, rules, grid)))(arenas, classes)
    planned, taken = drive(classes, levels, arenas.start_xyyaw, np.asarray(goal_ij), params)
    off = (taken - planned)[np.isfinite(planned)] / planned[np.isfinite(planned)]
    assert len(off) > B / 2 and np.isfinite(off).all()
    assert abs(np.median(off)) < 0.01 and np.quantile(np.abs(off), 0.9) < 0.05


def test_switches():
    assert CONFIG.params("full").planner == GridPlanner()
    assert MissionConfig(planner="heading").params("full").planner == PLANNER
    for name in ("kinematic", "sampled", "native", "mjx"):
        for placed in (True, False):
            assert mission_spec(MissionConfig(executor=name, foot_placement=placed), (1.8, 1.4)).footing == placed


def test_times_are_those_of_the_mission(params):
    times = times_of(params)
    assert [float(t) for t in jax.tree.leaves(times)] == [16, 5, 96, 96, 48, 10, 800]  # C4 at 8 s a unit
    assert math.isclose(float(times_of(replace(params, costs=planning.Costs(c0=3.0, c1=1.0))).unmeasured), 400)


@pytest.mark.slow
@pytest.mark.parametrize("executor", ["kinematic", "sampled"])
def test_missions_by_time_reach_the_goal_over_the_bump(executor):
    """Experiment 5, closed loop: the last plan that is logged leads on from where the robot stood then."""
    _, arena = load_scene(SCENE)
    config = MissionConfig(planner="heading", executor=executor)
    spec = mission_spec(config, tuple(round(float(v), 6) for v in arena.size_xy))
    mission = run_logged(MissionSetup(arena, config.params("full"), spec), jnp.uint32(7))
    assert mission.code == Code.REACHED and "Step-up-bump" in [played.name for played in mission.played]
    for plan, pose in zip(mission.log.plan[:-1], mission.log.estimated_xyyaw, strict=False):
        assert len(plan) == 0 or np.hypot(*(plan[0] - pose[:2])) < 0.05
    assert len(mission.log.plan[0]) > 10
