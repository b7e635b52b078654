"""Line sweeps straight from grids of kinds of cells: edge costs exist for a few arenas at a time, in the cache."""

from __future__ import annotations

import numpy as np
from numba import carray, njit

from jaxbiped.planning.compiled import foreign, line_sweep
from jaxbiped.planning.compiled.vector import pricing, transposition
from jaxbiped.planning.costs import FORBIDDEN

KINDS = FORBIDDEN + 1  # of moves
TILE = 16  # cells and arenas that change places together


def turning(lanes: int):
    """Functions between grids of `lanes` arenas, one after the other, and one grid with a ring and the arenas last.

    `spread(grids, first, height, width, ringed)` fills all but the ring from the grids of arena `first` and the next;
    `gather(ringed, grids, first, height, width)` is its inverse.
    """
    tile = min(lanes, TILE)
    transpose = transposition(tile)

    @njit(nogil=True)
    def spread(grids, first, height, width, ringed):
        for i in range(height):
            row, out = (first * height + i) * width, ((i + 1) * (width + 2) + 1) * lanes
            for lane in range(0, lanes, tile):
                source = row + lane * height * width
                if width < tile:
                    for other in range(tile):
                        for j in range(width):
                            ringed[out + j * lanes + lane + other] = grids[source + other * height * width + j]
                for start in range(0, width if width >= tile else 0, tile):
                    j = min(start, width - tile)  # the last tile overlaps the one before
                    transpose(grids, source + j, height * width, ringed, out + j * lanes + lane, lanes)

    @njit(nogil=True)
    def gather(ringed, grids, first, height, width):
        for i in range(height):
            row, out = (first * height + i) * width, ((i + 1) * (width + 2) + 1) * lanes
            for lane in range(0, lanes, tile):
                target = row + lane * height * width
                if width < tile:
                    for other in range(tile):
                        for j in range(width):
                            grids[target + other * height * width + j] = ringed[out + j * lanes + lane + other]
                for start in range(0, width if width >= tile else 0, tile):
                    j = min(start, width - tile)
                    transpose(ringed, out + j * lanes + lane, lanes, grids, target + j, height * width)

    return spread, gather


def solver(lanes: int, dtype):
    """Settles all arenas of a batch, `lanes` at a time, as `foreign.register` wants it.

    Arguments: kinds and levels of cells, int8 [B, H, W], B a multiple of `lanes`; prices float32 [B / lanes, 2, KINDS,
    lanes] of straight and oblique moves of each kind; whether corners may be cut, int8 [B]; goals int32 [B, 2].
    Results: cost float32 [B, H, W]; passes int32 [B]; and room to work in: `dtype` [cells * lanes], float32
    [4 * cells * lanes] and int8 [2 * cells * lanes], where cells = (H + 2) * (W + 2).
    """
    settle = line_sweep.sweeps(lanes)
    spread, gather = turning(lanes)
    straight, oblique = pricing(lanes, oblique=False), pricing(lanes, oblique=True)

    @njit(nogil=True)
    def solve(arguments, count, results):
        dims = foreign.shape(results, 0)
        batch, height, width = np.int64(dims[0]), np.int64(dims[1]), np.int64(dims[2])
        line, size = (width + 2) * lanes, (height + 2) * (width + 2) * lanes
        kinds = foreign.array(arguments, 0, batch * height * width, np.int8)
        levels = foreign.array(arguments, 1, batch * height * width, np.int8)
        prices = foreign.array(arguments, 2, batch * 2 * KINDS, np.float32)
        cutting = foreign.array(arguments, 3, batch, np.int8)
        goals = carray(foreign.pointer(foreign.data(arguments, 4)), (batch, 2), np.int32)
        field = foreign.array(results, 0, batch * height * width, np.float32)
        steps = foreign.array(results, 1, batch, np.int32)
        cost = foreign.array(results, 2, size, dtype)
        room = foreign.array(results, 3, 4 * size, np.float32)
        grids = foreign.array(results, 4, 2 * size, np.int8)
        kind, level = grids[:size], grids[size:]
        kind[:], level[:] = FORBIDDEN, 0  # the ring stays so
        edges = (room[:size], room[size : 2 * size], room[2 * size : 3 * size], room[3 * size :])
        ends = size - line - lanes  # from here on there is no cell below: nothing but ring
        for k in range(4):
            edges[k][ends:] = np.inf
        for first in range(0, batch, lanes):
            spread(kinds, first, height, width, kind)
            spread(levels, first, height, width, level)
            price, cut = prices[first * 2 * KINDS :], cutting[first:]
            slant = price[KINDS * lanes :]
            for n in range(0, ends, lanes):
                below, right, left = n + line, n + lanes, max(n - lanes, 0)
                straight(edges[0], n, kind, level, n, right, n, n, price, cut)
                oblique(edges[1], n, kind, level, n, below + lanes, below, right, slant, cut)
                straight(edges[2], n, kind, level, n, below, n, n, price, cut)
                oblique(edges[3], n, kind, level, n, below - lanes, below, left, slant, cut)
            cost[:] = np.inf
            for lane in range(lanes):
                i, j = goals[first + lane]
                if 0 <= i < height and 0 <= j < width:
                    cost[(i + 1) * line + (j + 1) * lanes + lane] = 0.0
            steps[first : first + lanes] = settle(
                edges + edges, goals[first : first + lanes], cost, 0, height, width, lanes, True
            )
            gather(cost, field, first, height, width)

    return solve
