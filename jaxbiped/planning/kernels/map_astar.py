"""One path of least cost on one map: A* with a queue of buckets, rooted at the goal, that ends early.

The path is the one that `path.read_path` reads off the whole field, ties included. It is read while the search goes on:
before each move, the search is carried so far that no cell which it has not settled could be as good a neighbour.
"""

from __future__ import annotations

import numpy as np

from jaxbiped.core import xla_ffi
from jaxbiped.planning.kernels.bucket_queue import (
    BUCKETS,
    EXPANDED,
    FINER,
    LIVE,
    MOST,
    NOW,
    QUEUE,
    TOUCHED,
    UNTIL_FOUND,
    begin,
    estimate,
    expansion,
    room_of,
)
from jaxbiped.planning.kernels.map_moves import CLASSES, DI, DJ, KINDS, PARTS, move_cost, parts, range_of, read_map

NONE, FOUND, ABANDONED = range(3)  # answers of a search
COST_ONLY = -2  # in place of a heading: the path is not wanted
MARGIN = 3e-6  # relative: what `path.TIE` and the rounding of float32 may make of two costs
LENGTH, ANSWER, SETTLED = range(3)  # places in what it tells
advance = expansion(directed=True)


def rooms(height: int, width: int) -> tuple[tuple[int, type], ...]:
    """Size and dtype of the arrays that hold a map and a search on it: bytes, costs, pool, queue, touched cells."""
    size = (height + 2) * (width + 2)
    pool = room_of.py_func(size)  # compiling it would take longer
    return (PARTS * size, np.int8), (size, np.float64), (pool, np.int64), (QUEUE, np.int64), (size, np.int64)


def reader():
    """`read_map` of one map, as `xla_ffi.register` wants it.

    Arguments: classes and levels, int8 [H, W]; the kind of a cell of each class, int8 [CLASSES]; whether corners may be
    cut, int8 [1]. Results: `rooms`, with a cost of inf everywhere.
    """

    @xla_ffi.compiled
    def read(arguments, count, results):
        dims = xla_ffi.shape(arguments, 0)
        height, width = np.int64(dims[0]), np.int64(dims[1])
        cells, size = height * width, (height + 2) * (width + 2)
        cutting = xla_ffi.array(arguments, 3, 1, np.int8)[0] != 0
        read_map(
            xla_ffi.array(arguments, 0, cells, np.int8), xla_ffi.array(arguments, 1, cells, np.int8), 0,
            xla_ffi.array(arguments, 2, CLASSES, np.int8), cutting, height, width,
            xla_ffi.array(results, 0, PARTS * size, np.int8),
        )  # fmt: skip
        xla_ffi.array(results, 1, size, np.float64)[:] = np.inf
        xla_ffi.array(results, 3, QUEUE, np.int64)[:] = 0

    return read


@xla_ffi.compiled
def least_moves(prices):
    """The least cost of a straight and of a diagonal move, neither more than a detour by the other."""
    straight, _ = range_of(prices[:KINDS])
    diagonal, _ = range_of(prices[KINDS:])
    diagonal = min(diagonal, 2 * straight)
    return min(straight, diagonal), diagonal


@xla_ffi.compiled
def search(kind, level, moves, mark, cost, line, prices, tie, start, goal, heading, pool, queue, touched, path):
    """(answer, number of moves): the moves from `start` to `goal` are then in `path`, if it has room for them.

    Args:
      prices: float32 [2 * KINDS]. tie: float32, 1 and the relative difference below which paths are equally good.
      start, goal: cells of the grid. heading: direction of the move before the first, -1 for none; or COST_ONLY.
    """
    for t in range(queue[TOUCHED]):  # what the last search left
        cost[touched[t]], mark[touched[t]] = np.inf, 0
    exact = prices.astype(np.float64)
    least, most = range_of(exact)
    straight, diagonal = least_moves(exact)
    touched[0], queue[TOUCHED] = goal, 1
    begin(goal, cost, mark, pool, queue)
    if start == goal:
        return FOUND, 0
    if moves[start] == 0 or moves[goal] == 0:
        return NONE, 0
    if least == 0:  # moves that cost nothing, on which a path does not descend
        return ABANDONED, 0
    aim = (start, straight, diagonal, estimate(goal, start, line, straight, diagonal))
    per_bucket = min(FINER / least, (BUCKETS - 4) / (most + diagonal))
    limit = MOST * len(cost)
    last, n, length, walked = UNTIL_FOUND, start, 0, 0.0
    while n != goal:
        advance(kind, level, moves, mark, cost, line, exact, aim, per_bucket, last, pool, queue, touched)
        if queue[EXPANDED] > limit:
            return ABANDONED, 0
        if cost[start] == np.inf:
            return NONE, 0
        if last != UNTIL_FOUND and heading == COST_ONLY:
            return FOUND, 0
        while n != goal:
            # No path through a neighbour that is as good as the best one costs more than this; the estimate of that
            # neighbour is at most what was walked and the move to it.
            last = np.int64(max(walked + cost[n] - aim[3], 0.0) * (1 + MARGIN) * per_bucket) + 1
            if (queue[NOW] <= last and queue[LIVE] > 0) or heading == COST_ONLY:
                break
            heading = pick(kind, level, moves, cost, line, prices, tie, n, heading)
            if heading < 0 or length == len(path):
                return ABANDONED, 0
            path[length] = heading
            length += 1
            m = n + DI[heading] * line + DJ[heading]
            walked += move_cost(kind, level, exact, n, m, heading)
            n = m
    return FOUND, length


@xla_ffi.compiled
def pick(kind, level, moves, cost, line, prices, tie, n, heading):
    """The direction that `path.pick` takes from cell `n`, in the same float32 numbers; -1 where none leads down."""
    allowed, own = np.int64(moves[n]), np.float32(cost[n])
    least, below = np.float32(np.inf), np.float32(np.inf)  # of all neighbours, and of those downhill
    for k in range(8):
        if (allowed >> k) & 1:
            m = n + DI[k] * line + DJ[k]
            near = np.float32(cost[m])
            ahead = np.float32(move_cost(kind, level, prices, n, m, k) + near)
            least = min(least, ahead)
            if near < own:
                below = min(below, ahead)
    if not below <= np.float32(least * tie):  # only across a plateau, or nowhere
        return -1
    first = -1
    for k in range(8):
        if (allowed >> k) & 1:
            m = n + DI[k] * line + DJ[k]
            near = np.float32(cost[m])
            ahead = np.float32(move_cost(kind, level, prices, n, m, k) + near)
            if near < own and ahead <= np.float32(below * tie):
                if k == heading:
                    return k
                if first < 0:
                    first = k
    return first


def searcher():
    """`search` as `xla_ffi.register` wants it.

    Arguments: prices, float32 [2, KINDS]; tie, float32 [1]; rows and columns of start and goal, and the heading, int32
    [5]; the map's classes, of which the shape counts. Results: path, int8 [L]; cost of the start, float64 [1];
    length, answer and expansions, int64 [3]; and `rooms`, as `reader` or the last search left them.
    """

    @xla_ffi.compiled
    def find(arguments, count, results):
        dims = xla_ffi.shape(arguments, 3)
        height, width = np.int64(dims[0]), np.int64(dims[1])
        size, line = (height + 2) * (width + 2), width + 2
        ends = xla_ffi.array(arguments, 2, 5, np.int32)
        path = xla_ffi.array(results, 0, np.int64(xla_ffi.shape(results, 0)[0]), np.int8)
        told = xla_ffi.array(results, 2, 3, np.int64)
        kind, level, moves, mark = parts(xla_ffi.array(results, 3, PARTS * size, np.int8), size)
        cost = xla_ffi.array(results, 4, size, np.float64)
        queue = xla_ffi.array(results, 6, QUEUE, np.int64)
        start, goal = (ends[0] + 1) * line + ends[1] + 1, (ends[2] + 1) * line + ends[3] + 1
        told[ANSWER], told[LENGTH] = search(
            kind, level, moves, mark, cost, line, xla_ffi.array(arguments, 0, 2 * KINDS, np.float32),
            xla_ffi.array(arguments, 1, 1, np.float32)[0], start, goal, np.int64(ends[4]),
            xla_ffi.array(results, 5, room_of(size), np.int64), queue, xla_ffi.array(results, 7, size, np.int64), path,
        )  # fmt: skip
        told[SETTLED] = queue[EXPANDED]
        xla_ffi.array(results, 1, 1, np.float64)[0] = cost[start]

    return find
