"""What a robot makes of its feet being in the way of something that it did not see."""

import jax.numpy as jnp
import numpy as np

from jaxbiped.geometry.pose import Pose
from jaxbiped.localisation.kalman_filter import Belief
from jaxbiped.mapping import Cell, GridSpec, classify, empty
from jaxbiped.mapping.config import MapConfig
from jaxbiped.mission.simulated_step import BACK, back_off, feel, hindered
from jaxbiped.mission.state import AgentState
from jaxbiped.motion.primitives import Command

GRID = GridSpec(size_x=0.6, size_y=0.45)


def command(turn=0.0, length=0.0, left=0.0, rise=0):
    return Command(
        turn=jnp.array([turn]),
        primitive=jnp.array([1]),
        length=jnp.array([length]),
        rise=jnp.array([rise]),
        squat=jnp.array([False]),
        left=jnp.array([left]),
    )


def test_hindered_is_what_did_not_come_to_where_it_was_led():
    went = jnp.array([[0.05, 0.0, 0.0]])
    stood = jnp.zeros((1, 3))
    assert not hindered(command(length=0.05), went)[0]
    assert hindered(command(length=0.05), stood)[0]
    assert hindered(command(turn=0.5), stood)[0]
    assert not hindered(command(turn=np.pi / 2, length=0.05), jnp.array([[0.0, 0.05, np.pi / 2]]))[0]
    assert not hindered(command(length=0.1, rise=1), stood)[0]  # a step is judged by its height
    assert not hindered(command(length=-0.04), stood)[0]  # else it would back off for ever


def test_what_was_felt_is_an_obstacle_ahead():
    agent = felt_at(Pose(*jnp.array([0.225, 0.225, 0.0, 0.0])), length=0.05)
    classes, _ = classify(agent.grid_map, MapConfig().params(), GRID)
    obstacles = np.argwhere(np.asarray(classes) == Cell.OBSTACLE)
    assert obstacles.tolist() == [[4, 5]]
    beyond = felt_at(Pose(*jnp.array([0.225, 0.225, 0.0, 0.0])), length=0.005)  # comes to stand in its own cell
    classes, _ = classify(beyond.grid_map, MapConfig().params(), GRID)
    assert np.argwhere(np.asarray(classes) == Cell.OBSTACLE).tolist() == [[4, 5]]


def felt_at(pose, length):
    """The agent of a robot at `pose` after its feet were stopped."""
    agent = AgentState(belief=Belief(pose, jnp.eye(3)), grid_map=empty(GRID), **dict.fromkeys(BARE))
    return feel(agent, pose, Command(*(leaf[0] for leaf in vars(command(length=length)).values())), GRID)


BARE = set(AgentState.__dataclass_fields__) - {"belief", "grid_map"}


def test_backing_off_goes_straight_back():
    back = back_off(command(turn=1.0, length=0.05, rise=1))
    assert float(back.length[0]) == -np.float32(BACK) and float(back.turn[0]) == 0.0 and int(back.rise[0]) == 0
