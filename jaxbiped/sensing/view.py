"""The result of one measurement: the same type from every sensor."""

from __future__ import annotations

from dataclasses import dataclass

import jax
from jaxtyping import Array, Bool, Float


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class View:
    """Points of one measurement in the robot frame of the moment, according to the robot's believed attitude.

    The camera's true attitude may differ by a degree; the points are then tilted, and `mapping` levels them.
    """

    x: Float[Array, "*B N"]  # [m] forward
    y: Float[Array, "*B N"]  # [m] left
    z: Float[Array, "*B N"]  # [m] up, from the supporting surface under the robot
    weight: Float[Array, "*B N"]  # pixels that the point represents; 0 where nothing was measured


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Sightings:
    """Landmarks as seen from the robot: one slot per landmark of the arena, correspondence known."""

    x: Float[Array, "*B L"]  # [m] forward, robot frame
    y: Float[Array, "*B L"]  # [m] left, robot frame
    sd: Float[Array, "*B L"]  # [m] standard deviation of x and of y
    seen: Bool[Array, "*B L"]
    motion: Motion | None = None  # since the previous view; only if the robot uses it


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Motion:
    """The pose of the robot in the robot frame of the previous view, from pictures alone."""

    x: Float[Array, "*B"]  # [m] forward
    y: Float[Array, "*B"]  # [m] left
    yaw: Float[Array, "*B"]  # [rad]
    cov: Float[Array, "*B 3 3"]  # of (x, y, yaw)
    seen: Bool[Array, "*B"]  # False: nothing was found, and the rest is zero
