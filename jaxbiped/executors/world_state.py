"""The true state of a mission, in which executors play commands and sensors measure."""

from __future__ import annotations

from dataclasses import dataclass

import jax
from jaxtyping import Array, Bool, Float, Int, UInt32

from jaxbiped.geometry.pose import Pose


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Planned:
    """Statistics of a mission's planning."""

    seconds: Float[Array, "*B"]  # [s] time taken; NaN if not known
    calls: Int[Array, "*B"]
    cost: Float[Array, "*B"]  # by Eq. 1, of the first path found; NaN if not known


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class WorldState:
    """The referee's side: read only by sensors and executors, never by the robot."""

    pose: Pose  # true pose of the robot
    squat: Bool[Array, "*B"]  # its stance
    distance: Float[Array, "*B"]  # [m] walked
    time: Float[Array, "*B"]  # [s]
    measurements: Int[Array, "*B"]
    decisions: Int[Array, "*B"]
    code: Int[Array, "*B"]  # Code
    seed: UInt32[Array, "*B"]  # seed of all noise of this mission
    pose_error: Float[Array, "*B"]  # [m] distance from the believed position
    yaw_error: Float[Array, "*B"]  # [rad] the same for yaw, without sign
    planned: Planned
    before: Pose | None = None  # its pose one command earlier; only if its motion is measured
    metrics: tuple = ()  # state of each metric


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class BodyPose:
    """The true pose of a robot's body: of the robot frame to which its cameras are fixed.

    In the home posture it is the frame of the feet; otherwise that frame, moved and tilted like the torso.
    """

    pose: Pose  # its origin and yaw
    roll: Float[Array, "*B"]  # [rad] to the right
    pitch: Float[Array, "*B"]  # [rad] forward and down
