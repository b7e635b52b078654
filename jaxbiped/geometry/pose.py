"""Planar poses of the robot.

World frame: x along the arena's long side, y to the left of it, z up, in metres. Robot frame: origin
on the supporting surface under the robot's vertical axis, x forward, y left, z up. Yaw is
anticlockwise from x, in radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Pose:
    """A pose of the robot in the world. Leaves are scalars, or share any batch shape."""

    x: Float[Array, "*B"]  # [m]
    y: Float[Array, "*B"]  # [m]
    z: Float[Array, "*B"]  # [m] height of the supporting surface
    yaw: Float[Array, "*B"]  # [rad]


def wrap_angle(angle: Float[Array, "*B"]) -> Float[Array, "*B"]:
    """`angle` [rad] wrapped to (-pi, pi]."""
    return -(jnp.mod(-angle + jnp.pi, 2 * jnp.pi) - jnp.pi)


def to_world(
    pose: Pose, x: Float[Array, "..."], y: Float[Array, "..."]
) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
    """Robot-frame (x, y) [m] in the world frame."""
    cos, sin = jnp.cos(pose.yaw), jnp.sin(pose.yaw)
    return pose.x + cos * x - sin * y, pose.y + sin * x + cos * y


def to_robot(
    pose: Pose, x: Float[Array, "..."], y: Float[Array, "..."]
) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
    """World (x, y) [m] in the robot frame."""
    cos, sin = jnp.cos(pose.yaw), jnp.sin(pose.yaw)
    dx, dy = x - pose.x, y - pose.y
    return cos * dx + sin * dy, -sin * dx + cos * dy
