"""One large map at a time: a few passes of line sweeps, then a list of the cells that still change.

Sweeps settle open ground in a few passes, but in a maze each pass settles a few corridors and looks at all
rows. There a list of changed cells, first in first out, does only what is left (Moore's variant of
Bellman-Ford, which looks at each cell of a corridor once). Written for `kernels.one_function`: the loops are
serial, and a cell costs about a tenth of a microsecond.
"""

from __future__ import annotations

import jax.numpy as jnp
from jax import lax

from jaxbiped.planning import kernels
from jaxbiped.planning.kernels import DI, DJ, put, take, wavefront

SWEEPS = 4  # passes before the list takes over: open ground needs no more, and on other ground the list is faster
LOOKS = 1  # at each cell, on average, before sweeps take over again: costs thrown at random mislead the list
WAITS = 256


def settle(edges, state):
    """As `kernels.settle` with line sweeps, for a batch of one; steps are those of the sweeps."""
    cells = state[0].size

    def again(state):
        _, _, steps, converged = state
        return ~converged[0] & (steps[0] < cells)

    def body(state):
        cost, rows, steps, _ = state
        cost, more, converged = kernels.settle(kernels.line_sweep, edges, (cost, rows), SWEEPS)
        cost, converged = lax.cond(converged[0], lambda _, cost: (cost, jnp.array([True])), relax, edges, cost)
        return cost, jnp.ones_like(rows), steps + more, converged

    state = *state, jnp.zeros(1, jnp.int32), jnp.array([False])
    cost, _, steps, converged = lax.while_loop(again, body, state)
    return cost, steps, converged


def relax(edges, cost):
    """Follow a list through what sweeps have left: (cost [H + 2, W + 2, 1], nothing left [1]).

    `edges` and `cost` as in `kernels`, for a batch of one.
    """
    shape = cost.shape
    (relaxed, _), _ = wavefront(edges, (cost, None), 0)
    changed = (relaxed < cost).reshape(-1).astype(jnp.int32)
    cost, count = relaxed.reshape(-1), changed.shape[0]
    edges = [e.reshape(-1) for e in edges]
    table = jnp.stack(edges, -1)  # a cell's costs lie together, where one read of memory brings them all
    offsets = jnp.array([di * shape[1] + dj for di, dj in zip(DI, DJ, strict=True)], jnp.int32)
    zero = jnp.int32(0)
    # one word a cell; bit k: move k leads into it (corridors have two, and only those are looked at); WAITS: listed
    word = WAITS * changed
    for k, (di, dj) in enumerate(zip(DI, DJ, strict=True)):
        edge = edges[k - 4] if k >= len(edges) else jnp.roll(edges[k], di * shape[1] + dj)
        word |= jnp.where(jnp.isfinite(edge), 1 << k, 0).astype(jnp.int32)

    def at(array, n):
        return take(array, (n,), (1,))[0]

    def set_(array, value, n):
        return put(array, value[None].astype(array.dtype), (n,))

    def enlist(n, state):
        queue, size = state
        return set_(queue, n, size), size + at(changed, n)

    # one slot more than cells: the write after the last entry lands there
    queue, size = lax.fori_loop(zero, jnp.int32(count), enlist, (jnp.zeros(count + 1, jnp.int32), zero))

    def wrap(n):
        return jnp.where(n >= count, n - count, n)

    def pop(state):
        cost, queue, word, head, size, pops = state

        # Two loops, the first only reading the large arrays and the second only writing them: the compiler
        # then updates them in place. Entry 0 takes the cell itself off the list.
        def look(state):
            cells, costs, words, found, moves = state
            cell, lowest = at(queue, head), moves & -moves
            k = lax.population_count(lowest - 1)
            before = cell - at(offsets, k)  # the move k leads from `before` to `cell`
            if len(edges) == 4:
                edge = take(table, (jnp.where(k < 4, before, cell), k % 4), (1, 1))[0, 0]
            else:
                edge = take(table, (before, k), (1, 1))[0, 0]
            total = at(cost, cell) + edge.astype(cost.dtype)
            better = total < at(cost, before)
            cells, costs = set_(cells, before, found), set_(costs, total, found)
            words = set_(words, at(word, before), found)
            return cells, costs, words, found + better.astype(jnp.int32), moves - lowest

        first = at(queue, head)
        small = set_(jnp.zeros(10, jnp.int32), first, zero), set_(jnp.zeros(10, cost.dtype), at(cost, first), zero)
        words = set_(jnp.zeros(10, jnp.int32), at(word, first), zero)
        small = *small, words, zero + 1, at(word, first) & (WAITS - 1)
        cells, costs, words, found, _ = lax.while_loop(lambda s: s[4] > 0, look, small)

        def write(n, state):
            cost, queue, word, tail, size = state
            cell, moves = at(cells, n), at(words, n) & (WAITS - 1)
            fresh = (at(words, n) < WAITS).astype(jnp.int32)
            cost, queue = set_(cost, at(costs, n), cell), set_(queue, cell, tail)
            word = set_(word, jnp.where(n > 0, moves + WAITS, moves), cell)
            return cost, queue, word, wrap(tail + fresh), size + fresh

        state = cost, queue, word, wrap(head + size), size
        cost, queue, word, _, size = lax.fori_loop(zero, found, write, state)
        return cost, queue, word, wrap(head + 1), size - 1, pops + 1

    def unfinished(state):
        return (state[4] > 0) & (state[5] < LOOKS * count)

    cost, _, _, _, size, _ = lax.while_loop(unfinished, pop, (cost, queue, word, zero, size, zero))
    return cost.reshape(shape), (size == 0)[None]
