"""The numbers of a mission that executors read, all traced."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import jax
from jaxtyping import Array, Float, Int

from jaxbiped.executors.motion_library import Library
from jaxbiped.mapping import Body
from jaxbiped.motion.primitives import Durations
from jaxbiped.motion.robot import Footing
from jaxbiped.sensing.odometry import OdometryNoise


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Limits:
    """Conditions that end a mission (`mission.config.LimitConfig`), traced, and the radius of the colliding body."""

    goal_radius: Float[Array, "*B"]  # [m]
    max_decisions: Int[Array, "*B"]
    max_looks: Int[Array, "*B"]
    edge_tolerance: Float[Array, "*B"]  # [m]
    height_tolerance: Float[Array, "*B"]  # [m]
    body_radius: Float[Array, "*B"]  # [m]
    rise: Float[Array, "*B"]  # [m] height of a step up or down: one level
    start_variance: Float[Array, "*B 3"]  # [m2, m2, rad2]


@runtime_checkable
class ExecutorParams(Protocol):
    """What executors read of a mission's parameters; `mission.params.MissionParams` has it."""

    durations: Durations
    body: Body
    odometry: OdometryNoise
    library: Library
    footing: Footing
    limits: Limits
