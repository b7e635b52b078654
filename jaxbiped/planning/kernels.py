"""Relaxation kernels with the batch as the last axis: a pass of line sweeps, a step of the wavefront.

`cost` is [H + 2, W + 2, B] with a ring of inf. `edges` is a tuple of arrays of that shape, also with a ring of
inf: the costs of leaving a cell in each of the eight `DIRECTIONS`, or of the first four only where a move costs
what the move back costs.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax import lax
from jax.experimental.xla_metadata import set_xla_metadata

from jaxbiped.planning.costs import DIRECTIONS

DI, DJ = ([int(d) for d in column] for column in DIRECTIONS.T)


def one_function(function):
    """Compile `function` to one machine function on a CPU, so that a step of its loops costs nanoseconds.

    By default XLA dispatches each operation of a loop's body by itself: about a microsecond a step, ten times
    the work of one step here. The two hints ask for a call that stays a call and is emitted whole; where a
    compiler does not know them, results are the same and come later.
    """

    def plain(*args):
        with set_xla_metadata(xla_cpu_small_call=None, inlineable=None):
            return function(*args)

    def call(*args):
        with set_xla_metadata(xla_cpu_small_call="true", inlineable="false"):
            return jax.jit(plain)(*args)

    return call if jax.default_backend() == "cpu" else function


def least(a, b):
    """Minimum as one machine instruction: `jnp.minimum` also carries NaN along, which these kernels never see."""
    return jnp.where(b < a, b, a)


def take(array, at, size):
    """`array[at : at + size]` for traced `at` inside the array."""
    return lax.dynamic_slice(array, at, size, allow_negative_indices=False)


def put(array, part, at):
    """`array` with `part` at the traced place `at`."""
    return lax.dynamic_update_slice(array, part, at, allow_negative_indices=False)


def line_sweep(edges, state, step):
    """Pass number `step` (down, up, down, ...) on (cost, rows [H + 2]); gives the same and changed [B].

    Each row relaxes from the row before and along itself, rightwards and then leftwards, so that a path which
    never turns back settles in one pass. After a pass all moves but those towards the other side are settled:
    a pass that changes nothing, after one the other way, ends the search. `rows` are those that the last pass
    changed (at first, those of the goals): a row is skipped unless the row before is one of them or has just
    changed.
    """
    cost, rows = state
    height, width, batch = cost.shape[0] - 2, cost.shape[1] - 2, cost.shape[2]
    up = step % 2 == 1
    side = jnp.where(up, 1, -1)  # where the row before lies
    none = jnp.full((1, batch), jnp.inf, cost.dtype)

    def one(array, i, j):
        return take(array, (i, j, 0), (1, 1, batch))[0].astype(cost.dtype)

    def west(i, j):
        return one(edges[0], i, j - 1) if len(edges) == 4 else one(edges[4], i, j)

    def across(k, i, j):
        if len(edges) == 4:
            return one(edges[k], jnp.minimum(i, i + side), jnp.where(up, j, j - DJ[k]))
        return jnp.where(up, one(edges[k], i, j), one(edges[k + 4], i, j))

    def row(i, seed, state):
        cost, rows_now, changed = state

        def rightwards(n, state):
            line, last = state
            j = n + 1
            new = least(take(line, (j, 0), (1, batch)), last + west(i, j))
            for k in (1, 2, 3):
                new = least(new, one(cost, i + side, j + side * DJ[k]) + across(k, i, j))
            return put(line, new, (j, 0)), new

        def leftwards(n, state):
            line, last, now = state
            j = width - n
            new = least(take(line, (j, 0), (1, batch)), last + one(edges[0], i, j))
            now = now | (new < one(cost, i, j)).astype(jnp.int32)
            return put(line, new, (j, 0)), new, now

        line = take(cost, (i, 0, 0), (1, width + 2, batch))[0]
        line, _ = lax.fori_loop(0, width, rightwards, (line, none))
        line, _, now = lax.fori_loop(0, width, leftwards, (line, none, jnp.zeros((1, batch), jnp.int32)))
        fresh = jnp.maximum(jnp.max(now).astype(jnp.float32), seed)
        return put(cost, line[None], (i, 0, 0)), put(rows_now, fresh[None], (i,)), changed | now

    def visit(n, state):
        i = jnp.where(up, height - n, n + 1)
        before = i + side
        seed = jnp.where(step == 0, take(rows, (i,), (1,))[0], 0.0)
        # a row that is skipped costs nothing at all, not even its copying
        active = (take(rows, (before,), (1,))[0] > 0) | (take(state[1], (before,), (1,))[0] > 0) | (seed > 0)
        return lax.fori_loop(0, active.astype(jnp.int32), lambda _, state: row(i, seed, state), state)

    state = cost, jnp.zeros_like(rows), jnp.zeros((1, batch), jnp.int32)
    cost, rows, changed = lax.fori_loop(0, height, visit, state)
    return (cost, rows), changed[0] > 0


def wavefront(edges, state, step):
    """Relax every cell from its eight neighbours at once, whatever the `step`; state and result as above."""
    cost, rows = state
    height, width = cost.shape[0] - 2, cost.shape[1] - 2

    def at(array, di, dj):
        return array[1 + di : 1 + di + height, 1 + dj : 1 + dj + width]

    new = inner = at(cost, 0, 0)
    for k in range(8):
        edge = at(edges[k], 0, 0) if k < len(edges) else at(edges[k - 4], DI[k], DJ[k])
        new = least(new, at(cost, DI[k], DJ[k]) + edge.astype(cost.dtype))
    return (cost.at[1:-1, 1:-1].set(new), rows), jnp.any(new < inner, axis=(0, 1))


METHODS = {"line_sweep": line_sweep, "wavefront": wavefront}


def default_method() -> str:
    """A CPU wants little work (line sweeps), an accelerator little depth (wavefront)."""
    return "line_sweep" if jax.default_backend() == "cpu" else "wavefront"


def beginning(edges, goal_ij, dtype):
    """State before the first step, costs to be summed as `dtype`: (cost, rows), 0 at each goal inside the grid."""
    height, width, _ = edges[0].shape
    rows, columns = (lax.broadcasted_iota(jnp.int32, (height, width, 1), a) for a in (0, 1))
    inside = (goal_ij >= 0).all(-1) & (goal_ij[:, 0] < height - 2) & (goal_ij[:, 1] < width - 2)
    goal = inside & (rows == goal_ij[:, 0] + 1) & (columns == goal_ij[:, 1] + 1)
    goal_rows = (inside & (rows[:, 0] == goal_ij[:, 0] + 1)).any(1)
    return jnp.where(goal, 0.0, jnp.inf).astype(dtype), goal_rows.astype(jnp.float32)


def settle(relax, edges, state, most=None):
    """Relax until nothing changes: (cost [H + 2, W + 2, B], steps until nothing changed [B], converged [B]).

    Every step settles one more cell of each least path at least, and every pass of line sweeps a row's worth
    and more, so that H * W steps always do: that is the bound, unless `most` is less.
    """
    height, width, batch = edges[0].shape

    def again(state):
        _, changed, _, step = state
        return (jnp.any(changed) & (step < (most or height * width))) | (step < 2)

    def body(state):
        state, _, steps, step = state
        state, changed = relax(edges, state, step)
        return state, changed, jnp.where(changed, step + 1, steps), step + 1

    state = state, jnp.ones((batch,), bool), jnp.zeros((batch,), jnp.int32), jnp.int32(0)
    (cost, _), changed, steps, _ = lax.while_loop(again, body, state)
    return cost, steps, ~changed
