"""Boxes that stand on the floor or hang above it: oriented in plan, upright in height.

A set of boxes is a structure of arrays, so that kernels run over rays or cells as long vectors and
unroll the few boxes (an array of structures runs about 20 times slower on a CPU).
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Boxes:
    """`M` box slots; unused slots have `used` False and any other values."""

    x: Float[Array, "*B M"]  # [m] centre
    y: Float[Array, "*B M"]  # [m] centre
    yaw: Float[Array, "*B M"]  # [rad]
    half_x: Float[Array, "*B M"]  # [m] half size along the box's own x
    half_y: Float[Array, "*B M"]  # [m] half size along the box's own y
    bottom: Float[Array, "*B M"]  # [m] height of the underside; 0 for a box that stands on the floor
    top: Float[Array, "*B M"]  # [m] height of the top
    overhead: Bool[Array, "*B M"]  # whether it hangs above the floor: part of the ceiling, not of the ground
    contrast: Float[Array, "*B M"]  # texture contrast, 0 (plain) to 1 (rich)
    used: Bool[Array, "*B M"]


def ground_height(
    boxes: Boxes, x: Float[Array, "*S"], y: Float[Array, "*S"], floor: Float[Array, "*S"] | None = None
) -> Float[Array, "*S"]:
    """Height [m] of the ground at points (x, y) [m] of one arena: the highest top of floor-standing boxes, else 0.

    Edges belong to the box. One arena: the leaves of `boxes` are [M]. With `floor`, the heights [m] of what the boxes
    stand on or in at these points, the ground is the higher of both.
    """
    height = jnp.zeros_like(x) if floor is None else floor
    for m in range(boxes.x.shape[-1]):
        here = covers(boxes, m, x, y) & ~boxes.overhead[m]
        height = jnp.where(here, jnp.maximum(height, boxes.top[m]), height)
    return height


def ceiling_height(boxes: Boxes, x: Float[Array, "*S"], y: Float[Array, "*S"]) -> Float[Array, "*S"]:
    """Height [m] of the ceiling at points (x, y) [m] of one arena: the lowest bottom of overhead boxes, else inf.

    Edges belong to the box. One arena: the leaves of `boxes` are [M].
    """
    height = jnp.full_like(x, jnp.inf)
    for m in range(boxes.x.shape[-1]):
        here = covers(boxes, m, x, y) & boxes.overhead[m]
        height = jnp.where(here, jnp.minimum(height, boxes.bottom[m]), height)
    return height


def covers(boxes: Boxes, m: int, x: Float[Array, "*S"], y: Float[Array, "*S"]) -> Bool[Array, "*S"]:
    """Whether box slot `m` of one arena is in use and lies, in plan, at the points (x, y) [m]."""
    cos, sin = jnp.cos(boxes.yaw[m]), jnp.sin(boxes.yaw[m])
    dx, dy = x - boxes.x[m], y - boxes.y[m]
    along, across = cos * dx + sin * dy, cos * dy - sin * dx
    return boxes.used[m] & (jnp.abs(along) <= boxes.half_x[m]) & (jnp.abs(across) <= boxes.half_y[m])


def plan_distance(boxes: Boxes, x: Float[Array, ""], y: Float[Array, ""]) -> Float[Array, "M"]:
    """Distance [m], in plan, from one point to each box of one arena; 0 inside; used or not."""
    cos, sin = jnp.cos(boxes.yaw), jnp.sin(boxes.yaw)
    dx, dy = x - boxes.x, y - boxes.y
    along = jnp.maximum(jnp.abs(cos * dx + sin * dy) - boxes.half_x, 0.0)
    across = jnp.maximum(jnp.abs(cos * dy - sin * dx) - boxes.half_y, 0.0)
    return jnp.hypot(along, across)


def footprint_extent(boxes: Boxes) -> tuple[Float[Array, "*B M"], Float[Array, "*B M"]]:
    """Half sizes [m] along the world's x and y of the rectangle that just holds each box's footprint."""
    cos, sin = jnp.abs(jnp.cos(boxes.yaw)), jnp.abs(jnp.sin(boxes.yaw))
    return cos * boxes.half_x + sin * boxes.half_y, sin * boxes.half_x + cos * boxes.half_y
