"""What an executor is: it plays a command of one arena in the true world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import jax
from jaxtyping import Array, Bool, Float

from jaxbiped.arenas.arena import Arena
from jaxbiped.geometry.pose import Pose
from jaxbiped.mission.settings import Settings
from jaxbiped.mission.state import World
from jaxbiped.motion.primitives import Command
from jaxbiped.motion.robot import STEP_TOLERANCE

CHECKS = (1 / 3, 2 / 3, 1.0)  # where on its way the body is checked against the boxes
TOUCH = STEP_TOLERANCE  # [m] contact that counts as none: rounding, and boxes that just end at a height
ODOMETRY = 2  # channel of a mission's seed
PLAY = 3  # channel of a mission's seed


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Execution:
    """What came of one command."""

    pose: Pose  # true, after it
    moved: Float[Array, "*B 3"]  # dx, dy [m], dyaw [rad] by odometry, in the robot frame before it
    variances: Float[Array, "*B 3"]  # of that
    time: Float[Array, "*B"]  # [s]
    distance: Float[Array, "*B"]  # [m]
    collided: Bool[Array, "*B"]
    fell: Bool[Array, "*B"]
    outside: Bool[Array, "*B"]


class Executor(Protocol):
    """Plays one command of one arena."""

    def __call__(self, arena: Arena, world: World, command: Command, settings: Settings) -> Execution: ...
