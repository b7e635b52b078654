"""Time to go over (cell, heading) by line sweeps: compiled for a CPU, many arenas a vector.

Within one heading all moves but those askew over an edge lead in one direction, so that one sweep against it settles a
layer of cells; turns join a layer to its two neighbours. Layers are swept, round and back, until nothing changes: as
often as the least ways turn, about.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numba import carray, njit

from jaxbiped.core import xla_ffi
from jaxbiped.planning.costs import DIRECTIONS
from jaxbiped.planning.kernels.vector_ops import relaxation

LANES = 8  # arenas a vector
DI, DJ = (tuple(int(d) for d in column) for column in DIRECTIONS.T)


@cache
def make_solver(rounds: int = 0):
    """A function `solve_lanes(time, face, turn, goals, field, settled, first, height, width)` of arenas `first` and on.

    `time`, `face` and `field` are [B * 8 * H * W] flat. Room of its own has the arenas last and a ring of inf:
    [8 * (H + 2) * (W + 2) * LANES]. Sums are float64. `settled` [B]: whether one more relaxation of every state lowers
    none.

    Args:
      rounds: of sweeps, at most; 0 for as many as there is any use for.
    """
    lanes = LANES
    relax = relaxation(lanes)

    @njit(nogil=True)
    def solve_lanes(time, face, turns, goals, field, settled, first, height, width):
        cells, line = height * width, (width + 2) * lanes
        plane = (height + 2) * line
        cost, own = np.full(8 * plane, np.inf), np.full(8 * plane, np.inf, np.float32)
        turn = turns[first : first + lanes].copy()
        askew = 0
        for lane in range(lanes):
            for k in range(8):
                for i in range(height):
                    at = ((first + lane) * 8 + k) * cells + i * width
                    n = k * plane + (i + 1) * line + lanes + lane
                    for j in range(width):
                        if face[at + j] == k:
                            own[n + j * lanes] = time[at + j]
                        elif time[at + j] < np.inf:
                            askew += 1
            i, j = goals[first + lane]
            if 0 <= i < height and 0 <= j < width:
                for h in range(8):
                    cost[h * plane + (i + 1) * line + (j + 1) * lanes + lane] = 0.0
        # moves askew, one a vector, in the order of the layers that they are made in
        places, steps = np.empty(askew, np.int64), np.empty(askew, np.int64)
        spent = np.full(askew * lanes, np.inf, np.float32)
        firsts = np.zeros(9, np.int64)
        count = 0
        for h in range(8):
            for k in ((h + 7) % 8, (h + 1) % 8):
                for lane in range(lanes if askew else 0):
                    for i in range(height):
                        at = ((first + lane) * 8 + k) * cells + i * width
                        for j in range(width):
                            if face[at + j] == h and time[at + j] < np.inf:
                                places[count] = h * plane + (i + 1) * line + (j + 1) * lanes
                                steps[count] = DI[k] * line + DJ[k] * lanes
                                spent[count * lanes + lane] = time[at + j]
                                count += 1
            firsts[h + 1] = count
        fresh = np.ones(8, np.bool_)  # layers that something has changed in or beside since they were swept
        there, round = True, 0
        while fresh.any() and (rounds == 0 or round < rounds):
            round += 1
            for q in range(8):
                h = q if there else 7 - q
                if not fresh[h]:
                    continue
                before, after = (h + 7) % 8, (h + 1) % 8
                less = np.uint64(0)
                for a in range(firsts[h], firsts[h + 1]):
                    less |= relax(cost, places[a], places[a] + steps[a], spent, a * lanes)
                left, right = (before - h) * plane, (after - h) * plane
                step = DI[h] * line + DJ[h] * lanes
                i, down = (height, -1) if DI[h] > 0 else (1, 1)
                j, aside = (width, -lanes) if DJ[h] > 0 else (1, lanes)
                for _ in range(height):
                    n = h * plane + i * line + j * lanes
                    for _ in range(width):
                        less |= relax(cost, n, n + left, turn, 0)
                        less |= relax(cost, n, n + right, turn, 0)
                        less |= relax(cost, n, n + step, own, n)
                        n += aside
                    i += down
                # moves askew lead to cells that may have been settled after them
                fresh[h] = less != 0 and firsts[h] < firsts[h + 1]
                if less:
                    fresh[before] = fresh[after] = True
            there = not there
        for lane in range(lanes):
            for k in range(8):
                for i in range(height):
                    at = ((first + lane) * 8 + k) * cells + i * width
                    n = k * plane + (i + 1) * line + lanes + lane
                    for j in range(width):
                        field[at + j] = cost[n + j * lanes]
        # the proof: every state once more, by each of the moves and turns out of it
        less = np.uint64(0)
        for a in range(count):
            less |= relax(cost, places[a], places[a] + steps[a], spent, a * lanes)
        for h in range(8):
            left, right = ((h + 7) % 8 - h) * plane, ((h + 1) % 8 - h) * plane
            step = DI[h] * line + DJ[h] * lanes
            for i in range(1, height + 1):
                n = h * plane + i * line + lanes
                for _ in range(width):
                    less |= relax(cost, n, n + left, turn, 0)
                    less |= relax(cost, n, n + right, turn, 0)
                    less |= relax(cost, n, n + step, own, n)
                    n += lanes
        for lane in range(lanes):
            settled[first + lane] = (less >> np.uint64(lane)) & np.uint64(1) == 0

    return solve_lanes


def solver():
    """`solve_lanes` for all arenas of a batch, no fewer than `LANES`, as `xla_ffi.register` wants it."""
    solve_lanes = make_solver()

    @njit
    def solve(arguments, count, results):
        dims = xla_ffi.shape(arguments, 0)
        batch, height, width = np.int64(dims[0]), np.int64(dims[2]), np.int64(dims[3])
        size = batch * 8 * height * width
        time = xla_ffi.array(arguments, 0, size, np.float32)
        face = xla_ffi.array(arguments, 1, size, np.int8)
        turn = xla_ffi.array(arguments, 2, batch, np.float32)
        goals = carray(xla_ffi.pointer(xla_ffi.data(arguments, 3)), (batch, 2), np.int32)
        field = xla_ffi.array(results, 0, size, np.float32)
        settled = xla_ffi.array(results, 1, batch, np.bool_)
        for start in range(0, batch, LANES):
            # the last arenas overlap those before
            solve_lanes(time, face, turn, goals, field, settled, min(start, batch - LANES), height, width)

    return solve
