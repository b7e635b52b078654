"""Relaxation kernels: cost to go by line sweeps and by a wavefront, on edges [8, H, W, B] with the batch last."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax import lax

from jaxbiped.planning.costs import DIRECTIONS

# directions that look back at the line before, for a sweep down, up, rightwards and leftwards
BACK = {"down": (5, 6, 7), "up": (1, 2, 3), "right": (3, 4, 5), "left": (7, 0, 1)}


def least(a, b):
    """Minimum as one machine instruction: `jnp.minimum` also carries NaN along, which these kernels never see."""
    return jnp.where(b < a, b, a)


def line_sweeps(edges, cost):
    """One round of four sweeps; in each a line relaxes from the line before, all of its cells at once.

    Within a sweep every path that keeps to a quarter plane settles at once, so that rounds count the turns of
    a path, not its cells. `cost` is [H + 2, W + 2, B] with a ring of inf.
    """
    _, height, width, batch = edges.shape

    def row(step, cost, backwards):
        i = height - 1 - step if backwards else step
        line = lax.dynamic_slice(cost, (i + 1, 1, 0), (1, width, batch))
        for k in BACK["up" if backwards else "down"]:
            di, dj = (int(d) for d in DIRECTIONS[k])
            near = lax.dynamic_slice(cost, (i + 1 + di, 1 + dj, 0), (1, width, batch))
            line = least(line, near + lax.dynamic_slice(edges, (k, i, 0, 0), (1, 1, width, batch))[0])
        return lax.dynamic_update_slice(cost, line, (i + 1, 1, 0))

    def column(step, cost, backwards):
        j = width - 1 - step if backwards else step
        line = lax.dynamic_slice(cost, (1, j + 1, 0), (height, 1, batch))
        for k in BACK["left" if backwards else "right"]:
            di, dj = (int(d) for d in DIRECTIONS[k])
            near = lax.dynamic_slice(cost, (1 + di, j + 1 + dj, 0), (height, 1, batch))
            line = least(line, near + lax.dynamic_slice(edges, (k, 0, j, 0), (1, height, 1, batch))[0])
        return lax.dynamic_update_slice(cost, line, (1, j + 1, 0))

    for relax, lines in ((row, height), (column, width)):
        for backwards in (False, True):
            cost = lax.fori_loop(0, lines, lambda s, c, r=relax, b=backwards: r(s, c, b), cost)
    return cost


def wavefront(edges, cost):
    """Relax every cell from its eight neighbours at once: little depth, much work."""
    _, height, width, _ = edges.shape
    inner = cost[1:-1, 1:-1]
    for k, (di, dj) in enumerate(DIRECTIONS):
        inner = least(inner, cost[1 + di : 1 + di + height, 1 + dj : 1 + dj + width] + edges[k])
    return cost.at[1:-1, 1:-1].set(inner)


def settle(relax, edges, goal_ij):
    """Relax until nothing changes; (cost [H, W, B], rounds [B], converged [B]).

    A round settles at least one more cell of each least path, so H * W rounds always do for sound costs.
    """
    _, height, width, batch = edges.shape
    rows, columns = (lax.broadcasted_iota(jnp.int32, (height + 2, width + 2, 1), a) - 1 for a in (0, 1))
    inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    start = jnp.where(inside & (rows == goal_ij[:, 0]) & (columns == goal_ij[:, 1]), 0.0, jnp.inf)
    start = start.astype(edges.dtype)

    def again(state):
        _, changed, rounds = state
        return jnp.any(changed & (rounds < height * width + 1))

    def body(state):
        cost, changed, rounds = state
        new = relax(edges, cost)
        return new, jnp.any(new < cost, axis=(0, 1)), rounds + changed

    start = start, jnp.ones((batch,), bool), jnp.zeros((batch,), jnp.int32)
    cost, changed, rounds = lax.while_loop(again, body, start)
    return cost[1:-1, 1:-1], rounds, ~changed


METHODS = {"line_sweep": line_sweeps, "wavefront": wavefront}


def default_method() -> str:
    """A CPU wants little work (line sweeps), an accelerator little depth (wavefront)."""
    return "line_sweep" if jax.default_backend() == "cpu" else "wavefront"
