"""Boxes that stand on the floor or hang above it: oriented in plan, upright in height.

A set of boxes is a structure of arrays, so that kernels run over rays or cells as long vectors and
unroll the few boxes (an array of structures runs about 20 times slower on a CPU).
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
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
    overhead: Bool[Array, "*B M"]  # hangs above the floor: part of the ceiling, not of the ground
    contrast: Float[Array, "*B M"]  # texture contrast, 0 (plain) to 1 (rich)
    used: Bool[Array, "*B M"]
