"""Cost-to-go by relaxing all cells at once until nothing changes: little depth and much work, as suits accelerators.

Arrays have the batch last. `cost` is [H + 2, W + 2, B] with a ring of inf; so are `edges`, a tuple of the costs of
leaving a cell in each of the eight `DIRECTIONS`, or of the first four only if a move costs the same in both directions.
"""

from __future__ import annotations

import jax.numpy as jnp
from jax import lax

from jaxbiped.planning.costs import DIRECTIONS

DI, DJ = ([int(d) for d in column] for column in DIRECTIONS.T)


def solve_edges(edges, goal_ij):
    """(cost [B, H, W] float32, rounds until nothing changed [B], whether the last changed nothing [B]); float64 sums.

    Every round settles at least one more cell of each lowest-cost path, so `most_rounds` are always enough.
    """
    height, width, batch = edges[0].shape
    most = most_rounds(height - 2, width - 2)

    def again(state):
        _, changed, _, step = state
        return jnp.any(changed) & (step < most)

    def body(state):
        cost, _, steps, step = state
        new = relaxed(edges, cost)
        changed = jnp.any(new < cost, axis=(0, 1))
        return new, changed, jnp.where(changed, step + 1, steps), step + 1

    start = beginning((height, width), goal_ij, jnp.float64)
    state = start, jnp.ones((batch,), bool), jnp.zeros((batch,), jnp.int32), jnp.int32(0)
    cost, changed, steps, _ = lax.while_loop(again, body, state)
    return jnp.moveaxis(cost[1:-1, 1:-1].astype(jnp.float32), -1, 0), steps, ~changed


def most_rounds(height: int, width: int) -> int:
    """Number of rounds after which nothing can change any more: the last of them shows it."""
    return height * width + 1


def relaxed(edges, cost):
    """`cost` with every cell relaxed from its eight neighbours at once."""
    height, width = cost.shape[0] - 2, cost.shape[1] - 2

    def at(array, di, dj):
        return array[1 + di : 1 + di + height, 1 + dj : 1 + dj + width]

    new = at(cost, 0, 0)
    for k in range(8):
        edge = at(edges[k], 0, 0) if k < len(edges) else at(edges[k - 4], DI[k], DJ[k])
        # not `jnp.minimum`, which also propagates NaN: there is none here, and a minimum is one instruction
        other = at(cost, DI[k], DJ[k]) + edge.astype(cost.dtype)
        new = jnp.where(other < new, other, new)
    return cost.at[1:-1, 1:-1].set(new)


def beginning(shape, goal_ij, dtype):
    """Cost before the first round, [*shape, B]: 0 at each goal inside the grid, inf elsewhere."""
    height, width = shape
    rows, columns = (lax.broadcasted_iota(jnp.int32, (height, width, 1), a) for a in (0, 1))
    inside = (goal_ij >= 0).all(-1) & (goal_ij[:, 0] < height - 2) & (goal_ij[:, 1] < width - 2)
    goal = inside & (rows == goal_ij[:, 0] + 1) & (columns == goal_ij[:, 1] + 1)
    return jnp.where(goal, 0.0, jnp.inf).astype(dtype)
