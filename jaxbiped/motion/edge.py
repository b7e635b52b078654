"""The direction of a bump's edge, measured from the map."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from jaxbiped.mapping.grid import Cell

WINDOW = 0.20  # [m] half side of the square of cells used to fit the direction; four cells of 5 cm


def crossing_direction(
    classes: Int[Array, "H W"],
    levels: Int[Array, "H W"],
    ij: Int[Array, "2"],
    step_ij: Int[Array, "2"],
    rise: Int[Array, ""],
    pitch: float,
) -> Float[Array, ""]:
    """World direction [rad] perpendicular to the bump's edge between a cell and its neighbour, across it (paper, 2.4).

    Around the edge, cells on the robot's level count -1 and cells on the level beyond count +1; the first moment of
    that pattern is perpendicular to the edge. Cells of other levels, obstacles and unmeasured cells do not count.
    The paper does not say how it measures the direction; here it is read from the classed grid, never from the truth.

    Args:
      ij: the robot's cell; `step_ij` the move (di, dj) to the neighbour on the other level.
      rise: level of the neighbour minus that of the robot's cell.
      pitch: static [m].

    Returns:
      The direction; that of the move itself if the pattern shows no edge within 50 degrees of it.
    """
    half = max(1, round(WINDOW / pitch))
    side = 2 * half + 1
    known = (classes != Cell.UNMEASURED) & (classes != Cell.OBSTACLE)
    here = levels[ij[0], ij[1]].astype(jnp.int32)
    relative = levels.astype(jnp.int32) - here
    pattern = jnp.where(known & (relative == rise), 1.0, 0.0) - jnp.where(known & (relative == 0), 1.0, 0.0)
    window = jax.lax.dynamic_slice(jnp.pad(pattern, half), (ij[0], ij[1]), (side, side))
    offset = jnp.arange(-half, half + 1, dtype=jnp.float32)
    # The edge lies half a move beyond the robot's cell: moments about that point, in a disc, to avoid bias by corners.
    di = offset[:, None] - 0.5 * step_ij[0]
    dj = offset[None, :] - 0.5 * step_ij[1]
    weight = window * (jnp.hypot(di, dj) <= half)
    mean_free = weight - jnp.abs(weight) * jnp.sum(weight) / jnp.maximum(jnp.sum(jnp.abs(weight)), 1.0)
    normal = jnp.arctan2(jnp.sum(mean_free * di), jnp.sum(mean_free * dj))
    ahead = jnp.arctan2(step_ij[0].astype(jnp.float32), step_ij[1].astype(jnp.float32))
    off = jnp.mod(normal - ahead + jnp.pi, 2 * jnp.pi) - jnp.pi
    seen = jnp.any(weight > 0) & jnp.any(weight < 0)
    return jnp.where(seen & (jnp.abs(off) < jnp.deg2rad(50.0)), normal, ahead)
