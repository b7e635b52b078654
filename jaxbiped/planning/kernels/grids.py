"""Line sweeps straight from grids of kinds of cells: edge costs exist for a few arenas at a time, in the cache."""

from __future__ import annotations

from functools import cache

import numpy as np
from numba import carray, njit

from jaxbiped.core import xla_ffi
from jaxbiped.mapping.grid import Cell
from jaxbiped.planning.costs import FORBIDDEN
from jaxbiped.planning.kernels import line_sweep
from jaxbiped.planning.kernels.line_sweep import LANES
from jaxbiped.planning.kernels.vector_ops import pricing, translation, transposition

KINDS = FORBIDDEN + 1  # of moves
CLASSES = len(Cell)
OBSTACLE = int(Cell.OBSTACLE)
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


def layout(batch: int, height: int, width: int) -> tuple[tuple[tuple[int, ...], type], ...]:
    """Shape and dtype of each argument of `solve_all`: classes, levels, kinds_of, prices, cutting, goals."""
    return (
        ((batch, height, width), np.int8),
        ((batch, height, width), np.int8),
        ((batch, CLASSES), np.int8),
        ((batch, 2, KINDS), np.float32),
        ((batch,), np.int8),
        ((batch, 2), np.int32),
    )


@cache
def make_solver(sweeps=line_sweep.sweeps):
    """The function `solve_all`, `LANES` arenas at a time, which adds up costs as float64.

    `solve_all(classes, levels, kinds_of, prices, cutting, goals, field, steps, settled, cost, room, bytes, height,
    width)`, all flat arrays but goals. Given for B >= LANES arenas: classes and levels of cells, int8 [B, H, W]; the
    kind of a cell of each class, int8 [B, 5]; what moves of each kind cost, straight and diagonal, float32 [B, 2,
    KINDS]; whether corners may be cut, int8 [B]; goals int32 [B, 2]. Written: the cost to go, float32 [B, H, W];
    passes, int32 [B]; whether one more relaxation lowers nothing, bool [B]. Room to work in: float64 [size], float32
    [4 * size], int8 [3 * size], with size = `room_size(height, width)`.

    Args:
      sweeps: of `LANES`, the function that settles.
    """
    lanes = LANES
    solve_lanes, unsettled = sweeps(lanes), line_sweep.proof(lanes)
    spread, gather = turning(lanes)
    kind_of = translation(lanes, CLASSES, Cell.OBSTACLE)
    straight, diagonal = pricing(lanes, diagonal=False), pricing(lanes, diagonal=True)

    @njit(nogil=True)
    def solve_all(
        classes, levels, kinds_of, prices, cutting, goals, field, steps, settled, cost, room, bytes, height, width
    ):
        line, size = (width + 2) * lanes, room_size(height, width)
        edges = (room[:size], room[size : 2 * size], room[2 * size : 3 * size], room[3 * size : 4 * size])
        seen, level, kind = bytes[:size], bytes[size : 2 * size], bytes[2 * size :]
        seen[:], level[:] = OBSTACLE, 0  # the ring stays so
        table, price = np.empty(CLASSES * lanes, np.int8), np.empty(2 * KINDS * lanes, np.float32)
        slant = price[KINDS * lanes :]
        ends = size - line - lanes  # from here on there is no cell below: nothing but ring
        for k in range(4):
            edges[k][ends:] = np.inf
        batch = len(steps)
        for start in range(0, batch, lanes):
            first = min(start, batch - lanes)  # the last arenas overlap those before
            for lane in range(lanes):
                for k in range(CLASSES):
                    table[k * lanes + lane] = kinds_of[(first + lane) * CLASSES + k]
                for k in range(2 * KINDS):
                    price[k * lanes + lane] = prices[(first + lane) * 2 * KINDS + k]
            spread(classes, first, height, width, seen)
            spread(levels, first, height, width, level)
            for n in range(0, size, lanes):
                kind_of(seen, table, kind, n)
            cut = cutting[first:]
            for n in range(0, ends, lanes):
                below, right, left = n + line, n + lanes, max(n - lanes, 0)
                straight(edges[0], n, kind, level, n, right, n, n, price, cut)
                diagonal(edges[1], n, kind, level, n, below + lanes, below, right, slant, cut)
                straight(edges[2], n, kind, level, n, below, n, n, price, cut)
                diagonal(edges[3], n, kind, level, n, below - lanes, below, left, slant, cut)
            cost[:] = np.inf
            for lane in range(lanes):
                i, j = goals[first + lane]
                if 0 <= i < height and 0 <= j < width:
                    cost[(i + 1) * line + (j + 1) * lanes + lane] = 0.0
            steps[first : first + lanes] = solve_lanes(
                edges + edges, goals[first : first + lanes], cost, 0, height, width, lanes, True
            )
            gather(cost, field, first, height, width)
            wrong = unsettled(edges + edges, cost, 0, height, width, lanes, True)
            for lane in range(lanes):
                settled[first + lane] = (wrong >> np.uint64(lane)) & np.uint64(1) == 0

    return solve_all


@njit(nogil=True)
def room_size(height, width):
    """Elements of a grid of `LANES` arenas with its ring."""
    return (height + 2) * (width + 2) * LANES


def rooms(height: int, width: int) -> tuple[tuple[int, type], ...]:
    """Size and dtype of the arrays to work in."""
    size = room_size.py_func(height, width)  # compiling it would take longer
    return (size, np.float64), (4 * size, np.float32), (3 * size, np.int8)


def solver():
    """`solve_all` as `xla_ffi.register` wants it: the first six arrays are arguments, the other six results."""
    solve_all = make_solver()

    @njit
    def solve(arguments, count, results):
        dims = xla_ffi.shape(results, 0)
        batch, height, width = np.int64(dims[0]), np.int64(dims[1]), np.int64(dims[2])
        cells, size = batch * height * width, room_size(height, width)
        solve_all(
            xla_ffi.array(arguments, 0, cells, np.int8),
            xla_ffi.array(arguments, 1, cells, np.int8),
            xla_ffi.array(arguments, 2, batch * CLASSES, np.int8),
            xla_ffi.array(arguments, 3, batch * 2 * KINDS, np.float32),
            xla_ffi.array(arguments, 4, batch, np.int8),
            carray(xla_ffi.pointer(xla_ffi.data(arguments, 5)), (batch, 2), np.int32),
            xla_ffi.array(results, 0, cells, np.float32),
            xla_ffi.array(results, 1, batch, np.int32),
            xla_ffi.array(results, 2, batch, np.bool_),
            xla_ffi.array(results, 3, size, np.float64),
            xla_ffi.array(results, 4, 4 * size, np.float32),
            xla_ffi.array(results, 5, 3 * size, np.int8),
            height,
            width,
        )

    return solve
