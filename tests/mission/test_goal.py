"""A wall beside the goal does not close it while the goal's circle has a free cell."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.arenas.scene import BoxConfig, LandmarkConfig, SceneConfig, to_arena
from jaxbiped.mapping import Cell, GridSpec
from jaxbiped.mission.goal import MARGIN, goal_cell
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import MissionConfig, mission_spec
from jaxbiped.mission.recorded_driver import run_logged
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.planning import Rules
from jaxbiped.sensing.counter_rng import from_key

GRID = GridSpec()
MARKS = tuple(LandmarkConfig(kind="circle", at=at) for at in ((0.6, 0.2), (0.6, 1.2), (1.7, 0.4), (1.7, 1.0)))
find = jax.jit(lambda goal, classes, rules: goal_cell(goal, jnp.float32(0.1), classes, rules, GRID))


def test_nearest_free_cell_of_the_circle():
    rng = np.random.default_rng(0)
    for _ in range(50):
        goal = rng.uniform([0.2, 0.2], [1.6, 1.2]).astype(np.float32)
        classes = rng.choice([Cell.FLOOR, Cell.BUMP, Cell.OBSTACLE], GRID.shape, p=[0.2, 0.2, 0.6]).astype(np.int8)
        i, j = np.asarray(find(jnp.asarray(goal), jnp.asarray(classes), Rules(bumps=False)))
        own = int(goal[1] // 0.05), int(goal[0] // 0.05)
        y, x = (np.indices(GRID.shape) + 0.5) * 0.05
        away = np.hypot(x - goal[0], y - goal[1])
        free = (classes == Cell.FLOOR) & (away <= 0.1 - MARGIN)
        free[own] = classes[own] == Cell.FLOOR
        if free[own] or not free.any():
            assert (i, j) == own
        else:
            assert away[i, j] == pytest.approx(away[free].min(), abs=1e-6)


@pytest.mark.parametrize("gap", [0.10, 0.13])
def test_goal_before_a_wall_is_reached(gap):
    wall = BoxConfig(centre=(1.4 + gap + 0.05, 0.7), size=(0.1, 0.8), top=0.3)
    arena = to_arena(SceneConfig(name="wall", start=(0.3, 0.7, 0.0), goal=(1.4, 0.7), boxes=(wall,), landmarks=MARKS))
    config = MissionConfig()
    setup = MissionSetup(arena, config.params("full"), mission_spec(config, (1.8, 1.4)))
    mission = run_logged(setup, from_key(jax.random.key(0)))
    assert mission.code == Code.REACHED


def test_robot_that_could_step_higher_still_steps_one_level():
    bump = BoxConfig(centre=(0.9, 0.7), size=(0.4, 1.4), top=0.03)
    arena = to_arena(SceneConfig(name="bump", start=(0.3, 0.7, 0.0), goal=(1.4, 0.7), boxes=(bump,), landmarks=MARKS))
    config = MissionConfig(robot={"step": 0.044})
    setup = MissionSetup(arena, config.params("full"), mission_spec(config, (1.8, 1.4)))
    mission = run_logged(setup, from_key(jax.random.key(0)))
    assert mission.code == Code.REACHED and "Step-up-bump" in {played.name for played in mission.played}
