"""Time to go over (cell, heading) by Dijkstra's method, compiled for a CPU, one arena after the other, in float64."""

from __future__ import annotations

import heapq
from functools import cache
from threading import Lock

import jax
import jax.numpy as jnp
import numpy as np
from numba import carray, njit

from jaxbiped.core import xla_ffi
from jaxbiped.core.ready_programs import TARGETS
from jaxbiped.planning.costs import DIRECTIONS
from jaxbiped.planning.kernels import heading_sweep as sweep

DI, DJ = (tuple(int(d) for d in column) for column in DIRECTIONS.T)
LOCK = Lock()


@njit(nogil=True)
def is_settled(time, face, turn, height, width, cost):
    """Whether no state can be lowered by any of the moves and turns out of it; arguments as of `solve_arena`."""
    cells = height * width
    for state in range(8 * cells):
        h, n = state // cells, state % cells
        least = turn + min(cost[(h + 1) % 8 * cells + n], cost[(h + 7) % 8 * cells + n])
        i, j = n // width, n % width
        for k in ((h + 7) % 8, h, (h + 1) % 8):
            a, b = i + DI[k], j + DJ[k]
            if 0 <= a < height and 0 <= b < width and face[k * cells + n] == h:
                least = min(least, cost[h * cells + a * width + b] + time[k * cells + n])
        if least < cost[state]:
            return False
    return True


@njit(nogil=True)
def solve_arena(time, face, turn, goal_i, goal_j, height, width, cost):
    """One arena: `time` and `face` [8 * H * W] flat; `cost` [8 * H * W] is written. Returns whether it is settled."""
    cells = height * width
    cost[:] = np.inf
    heap = [(0.0, 0)]
    heap.pop()
    if 0 <= goal_i < height and 0 <= goal_j < width:
        for h in range(8):
            cost[h * cells + goal_i * width + goal_j] = 0.0
            heap.append((0.0, h * cells + goal_i * width + goal_j))
    while heap:
        so_far, state = heapq.heappop(heap)
        if so_far > cost[state]:
            continue
        h, n = state // cells, state % cells
        for other in ((h + 1) % 8, (h + 7) % 8):
            before, total = other * cells + n, so_far + turn
            if total < cost[before]:
                cost[before] = total
                heapq.heappush(heap, (total, before))
        i, j = n // width, n % width
        for k in ((h + 7) % 8, h, (h + 1) % 8):
            a, b = i - DI[k], j - DJ[k]  # from where a move in direction k leads here
            if 0 <= a < height and 0 <= b < width and face[k * cells + a * width + b] == h:
                before, total = h * cells + a * width + b, so_far + time[k * cells + a * width + b]
                if total < cost[before]:
                    cost[before] = total
                    heapq.heappush(heap, (total, before))
    return is_settled(time, face, turn, height, width, cost)


@njit(nogil=True)
def solve(arguments, count, results):
    """All arenas, as `xla_ffi.register` wants it."""
    dims = xla_ffi.shape(arguments, 0)
    batch, height, width = np.int64(dims[0]), np.int64(dims[2]), np.int64(dims[3])
    size = 8 * height * width
    time = xla_ffi.array(arguments, 0, batch * size, np.float32)
    face = xla_ffi.array(arguments, 1, batch * size, np.int8)
    turn = xla_ffi.array(arguments, 2, batch, np.float32)
    goals = carray(xla_ffi.pointer(xla_ffi.data(arguments, 3)), (batch, 2), np.int32)
    field = xla_ffi.array(results, 0, batch * size, np.float32)
    settled = xla_ffi.array(results, 1, batch, np.bool_)
    cost = np.empty(size)
    for arena in range(batch):
        part, (i, j) = slice(arena * size, (arena + 1) * size), goals[arena]
        settled[arena] = solve_arena(time[part], face[part], float(turn[arena]), i, j, height, width, cost)
        field[part] = cost


@cache
def registered(method: str) -> tuple[str, int]:
    """The name by which XLA knows a kernel, and its lanes; compiled at the first call."""
    name = f"jaxbiped_heading_{method}"
    TARGETS[name] = __name__, (method,)
    xla_ffi.register(name, solve if method == "dijkstra" else sweep.solver(), keep=True)
    return name, 1 if method == "dijkstra" else sweep.LANES


def solve_headings(time, face, turn, goal_ij, method: str):
    """Least time [B, 8, H, W] float32 from each heading and cell to the goal, in any heading there, summed as float64;
    and whether it is settled, bool [B].

    Args:
      time: of moves out of each cell in each direction, without the turn to `face`; float32 [B, 8, H, W], none NaN or
        negative.
      face: the heading in which each is made, at most one eighth off its direction; int8 [B, 8, H, W].
      turn: of one eighth, float32 [B], not negative.
      goal_ij: int32 [B, 2]; nothing is reached from one outside the grid.
      method: "line_sweep" or "dijkstra".
    """
    with LOCK:
        name, lanes = registered(method)
    batch = len(time)
    inputs = time, face, turn, goal_ij
    layout = ((time.shape, np.float32), (time.shape, np.int8), ((batch,), np.float32), ((batch, 2), np.int32))
    for array, (shape, dtype) in zip(inputs, layout, strict=True):
        xla_ffi.expect(array, shape, dtype)
    if batch < lanes:
        # of no moves: there is nothing to sweep in the lanes that are added
        inputs = [
            jnp.pad(a, ((0, lanes - batch),) + ((0, 0),) * (a.ndim - 1), constant_values=fill)
            for a, fill in zip(inputs, (jnp.inf, 0, 0, -1), strict=True)
        ]
    many = max(batch, lanes)
    results = jax.ShapeDtypeStruct(inputs[0].shape, jnp.float32), jax.ShapeDtypeStruct((many,), jnp.bool_)
    cost, settled = jax.ffi.ffi_call(name, results)(*inputs)
    return cost[:batch], settled[:batch]
