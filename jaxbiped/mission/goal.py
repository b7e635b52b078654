"""The cell that a plan leads to."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from jaxbiped.mapping import GridSpec
from jaxbiped.motion.selection import cell_of
from jaxbiped.planning import Rules
from jaxbiped.planning.costs import FORBIDDEN, cell_kinds

MARGIN = 0.02  # [m] a robot this far from the cell's centre must still be within the goal's circle


def goal_cell(
    goal_xy: Float[Array, "2"], radius: Float[Array, ""], classes: Int[Array, "H W"], rules: Rules, grid: GridSpec
) -> Int[Array, "2"]:
    """Of the cells whose centre is well within `radius` [m] of the goal, the nearest that is not blocked.

    The goal is reached within a circle (paper, 3.1), so a wall beside it must not block it. If all are blocked, the
    cell that contains the goal.
    """
    rows, columns = jnp.arange(grid.shape[0]), jnp.arange(grid.shape[1])
    dx, dy = (columns + 0.5) * grid.pitch - goal_xy[0], (rows + 0.5) * grid.pitch - goal_xy[1]
    away = jnp.hypot(dx[None, :], dy[:, None])
    own = cell_of(goal_xy[0], goal_xy[1], grid)
    away = away.at[own[0], own[1]].set(0.0)
    near = (away <= radius - MARGIN) & (cell_kinds(classes, rules) != FORBIDDEN)
    best = jnp.argmin(jnp.where(near, away, jnp.inf))
    found = jnp.stack(jnp.unravel_index(best, grid.shape)).astype(jnp.int32)
    return jnp.where(jnp.any(near), found, own)
