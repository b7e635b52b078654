"""Whole cost-to-go fields by a queue of buckets, straight from grids, one map after the other."""

from __future__ import annotations

import numpy as np
from numba import carray

from jaxbiped.core import xla_ffi
from jaxbiped.planning.kernels.bucket_queue import BUCKETS, QUEUE, WORDS, begin, expansion, is_settled, room_of
from jaxbiped.planning.kernels.map_moves import CLASSES, KINDS, PARTS, parts, range_of, read_map

advance = expansion(directed=False)


def rooms(height: int, width: int) -> tuple[tuple[int, type], ...]:
    """Size and dtype of the arrays to work in: costs, bytes, pool, queue."""
    size = (height + 2) * (width + 2)
    pool = room_of.py_func(size)  # compiling it would take longer
    return (size, np.float64), (PARTS * size, np.int8), (pool, np.int64), (QUEUE, np.int64)


@xla_ffi.compiled
def solve_map(
    classes, levels, first, kinds_of, prices, cutting, goal_i, goal_j, height, width, cost, bytes, pool, queue
):
    """Settle one map; `cost` is then that of each cell, with a ring of inf. Whether it is exact."""
    line, size = width + 2, (height + 2) * (width + 2)
    read_map(classes, levels, first, kinds_of, cutting, height, width, bytes)
    kind, level, moves, mark = parts(bytes, size)
    cost[:] = np.inf
    if not (0 <= goal_i < height and 0 <= goal_j < width):
        return True
    least, most = range_of(prices)
    per_bucket = 1.0 / least if least > 0 else np.inf
    if not most * per_bucket + 4.0 <= BUCKETS:
        per_bucket = (BUCKETS - 4) / most if most > 0 else 0.0
    begin((goal_i + 1) * line + goal_j + 1, cost, mark, pool, queue)
    aim, touched = (np.int64(0), 0.0, 0.0, 0.0), pool  # of directed searches
    advance(kind, level, moves, mark, cost, line, prices, aim, per_bucket, WORDS, pool, queue, touched)
    return is_settled(kind, level, moves, cost, height, width, prices)


def solver():
    """`solve_map` of all maps of a batch, as `xla_ffi.register` wants it.

    Arguments as `grids.layout`; results: field float32 [B, H, W], steps int32 [B], settled bool [B], and `rooms`.
    """

    @xla_ffi.compiled
    def solve(arguments, count, results):
        dims = xla_ffi.shape(results, 0)
        batch, height, width = np.int64(dims[0]), np.int64(dims[1]), np.int64(dims[2])
        cells, size, line = height * width, (height + 2) * (width + 2), width + 2
        classes = xla_ffi.array(arguments, 0, batch * cells, np.int8)
        levels = xla_ffi.array(arguments, 1, batch * cells, np.int8)
        kinds_of = xla_ffi.array(arguments, 2, batch * CLASSES, np.int8)
        prices = xla_ffi.array(arguments, 3, batch * 2 * KINDS, np.float32)
        cutting = xla_ffi.array(arguments, 4, batch, np.int8)
        goals = carray(xla_ffi.pointer(xla_ffi.data(arguments, 5)), (batch, 2), np.int32)
        field = xla_ffi.array(results, 0, batch * cells, np.float32)
        steps = xla_ffi.array(results, 1, batch, np.int32)
        settled = xla_ffi.array(results, 2, batch, np.bool_)
        cost = xla_ffi.array(results, 3, size, np.float64)
        bytes = xla_ffi.array(results, 4, PARTS * size, np.int8)
        pool = xla_ffi.array(results, 5, room_of(size), np.int64)
        queue = xla_ffi.array(results, 6, QUEUE, np.int64)
        for b in range(batch):
            own = kinds_of[b * CLASSES : (b + 1) * CLASSES]
            price = prices[b * 2 * KINDS : (b + 1) * 2 * KINDS].astype(np.float64)
            steps[b] = 1
            settled[b] = solve_map(
                classes, levels, b * cells, own, price, cutting[b] != 0, np.int64(goals[b, 0]), np.int64(goals[b, 1]),
                height, width, cost, bytes, pool, queue,
            )  # fmt: skip
            for i in range(height):
                for j in range(width):
                    field[b * cells + i * width + j] = cost[(i + 1) * line + j + 1]

    return solve
