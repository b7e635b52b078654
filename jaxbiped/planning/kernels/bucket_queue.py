"""Cost-to-go on one map with a queue of buckets, each of the cells within one range of costs, in float64.

Dijkstra's method with Dial's queue (R. B. Dial, Algorithm 360, CACM 12, 1969). A bucket is no wider than the least cost
of a move, so that no cell of a bucket improves another one, and each is expanded once, in constant time, where a heap
takes a logarithm of its size. Where costs differ too much for that many buckets, they are wider, and a bucket is gone
through in rounds until no cell of it improves. Costs are exact either way: sums along paths, the least of each cell.

A search for one path puts cells in buckets by what a whole path through them costs at least (Hart, Nilsson and Raphael
1968), and stops early.
"""

from __future__ import annotations

import numpy as np

from jaxbiped.core import xla_ffi
from jaxbiped.planning.costs import IN_GATE, LEVEL, STEP, UNMEASURED
from jaxbiped.planning.kernels.map_moves import DI, DJ, KINDS, move_cost

BUCKETS = 1 << 14  # of the queue, a ring
FREE, USED, LIVE, NOW = range(BUCKETS, BUCKETS + 4)  # places of its state, after the first entry of each bucket
EXPANDED, TOUCHED = range(BUCKETS + 4, BUCKETS + 6)
QUEUE = BUCKETS + 6
WAITING, DONE = 1, 2  # marks of cells
WORDS = 1 << 60  # more buckets, and more cells, than there are
UNTIL_FOUND = -1
MOST = 8  # expansions per cell before a search is abandoned: its order does not fit such costs
FINER = 8  # buckets of a search within the least cost of a move: cells in the order of their costs are rarely redone


@xla_ffi.compiled
def room_of(size):
    """Entries of a pool for a map of `size` cells."""
    return 2 * size + 16


@xla_ffi.compiled
def begin(goal, cost, mark, pool, queue):
    """A queue that holds the goal alone; costs are inf and marks 0 elsewhere."""
    queue[:BUCKETS] = -1
    cost[goal], mark[goal] = 0.0, WAITING
    pool[0], queue[0] = (np.int64(-1) << 32) | goal, 0
    queue[FREE], queue[USED], queue[LIVE], queue[NOW], queue[EXPANDED] = -1, 1, 1, 0, 0


@xla_ffi.compiled
def estimate(n, start, line, straight, diagonal):
    """The least that a way from cell `n` to `start` costs on an empty map."""
    return distance(n // line - start // line, n % line - start % line, straight, diagonal)


@xla_ffi.compiled
def distance(i, j, straight, diagonal):
    """The same, by the difference of rows and of columns."""
    i, j = abs(i), abs(j)
    return diagonal * min(i, j) + straight * (max(i, j) - min(i, j))


def expansion(directed: bool):
    """A function `advance(kind, level, moves, mark, cost, line, prices, aim, per_bucket, last, pool, queue, touched)`.

    It expands cells up to bucket number `last`, whose costs, and those of all buckets before it, are then exact; with
    UNTIL_FOUND up to the first bucket after which `aim` has a cost.

    Args:
      directed: whether buckets are by what a path to `aim` costs at least: (cell, least straight and diagonal cost,
        `estimate` of the goal). New cells are then also listed in `touched`, and counted.
    """

    @xla_ffi.compiled
    def bucket_of(so_far, i, j, aim, per_bucket):
        if directed:
            so_far = max(so_far + distance(i, j, aim[1], aim[2]) - aim[3], 0.0)
        return np.int64(so_far * per_bucket)

    @xla_ffi.compiled
    def refill(mark, cost, line, aim, per_bucket, pool, queue):
        """Entries of waiting cells alone, where those that were improved since have filled the pool."""
        queue[:BUCKETS] = -1
        used = 0
        for n in range(len(cost)):
            if mark[n] == WAITING:
                i, j = n // line - aim[0] // line, n % line - aim[0] % line
                at = max(bucket_of(cost[n], i, j, aim, per_bucket), queue[NOW]) & (BUCKETS - 1)
                pool[used], queue[at] = (queue[at] << 32) | n, used
                used += 1
        queue[FREE], queue[USED], queue[LIVE] = -1, used, used

    @xla_ffi.compiled
    def advance(kind, level, moves, mark, cost, line, prices, aim, per_bucket, last, pool, queue, touched):
        free, used, live, now, expanded = queue[FREE], queue[USED], queue[LIVE], queue[NOW], queue[EXPANDED]
        offsets = (
            DI[0] * line + DJ[0], DI[1] * line + DJ[1], DI[2] * line + DJ[2], DI[3] * line + DJ[3],
            DI[4] * line + DJ[4], DI[5] * line + DJ[5], DI[6] * line + DJ[6], DI[7] * line + DJ[7],
        )  # fmt: skip
        aim_i, aim_j = aim[0] // line, aim[0] % line
        most = MOST * len(cost) if directed else WORDS
        while live > 0 and expanded <= most:
            if now > last and not (directed and last == UNTIL_FOUND and cost[aim[0]] == np.inf):
                break
            at = now & (BUCKETS - 1)
            s = queue[at]
            while s >= 0:  # a round
                queue[at] = -1
                while s >= 0:
                    entry = pool[s]
                    n, following = entry & 0xFFFFFFFF, entry >> 32
                    pool[s], free, live, s = free, s, live - 1, following
                    if mark[n] != WAITING:  # improved since, and expanded already
                        continue
                    mark[n] = DONE
                    expanded += 1
                    if live + 8 > len(pool):
                        queue[NOW] = now
                        refill(mark, cost, line, aim, per_bucket, pool, queue)
                        free, used, live, s = queue[FREE], queue[USED], queue[LIVE], np.int64(-1)
                    so_far, allowed, i, j = cost[n], np.int64(moves[n]), 0, 0
                    if directed:  # one division for all neighbours
                        row = np.uint32(n) // np.uint32(line)
                        i, j = np.int64(row) - aim_i, n - np.int64(row) * line - aim_j
                    for k in range(8):
                        if (allowed >> k) & 1 == 0:
                            continue
                        m = n + offsets[k]
                        new = so_far + move_cost(kind, level, prices, n, m, k)
                        if new < cost[m]:
                            if directed and cost[m] == np.inf:
                                touched[queue[TOUCHED]] = m
                                queue[TOUCHED] += 1
                            cost[m], mark[m] = new, WAITING
                            if free >= 0:
                                t, free = free, pool[free]
                            else:
                                t, used = used, used + 1
                            to = max(bucket_of(new, i + DI[k], j + DJ[k], aim, per_bucket), now) & (BUCKETS - 1)
                            pool[t], queue[to] = (queue[to] << 32) | m, t
                            live += 1
                s = queue[at]
            now += 1
        queue[FREE], queue[USED], queue[LIVE], queue[NOW], queue[EXPANDED] = free, used, live, now, expanded

    return advance


@xla_ffi.compiled
def is_settled(kind, level, moves, cost, height, width, prices):
    """Whether no move lowers a cost: one more relaxation of all cells changes nothing."""
    line, lower = width + 2, 0
    for i in range(height):
        n = (i + 1) * line + 1
        for k in range(4):  # and back, which costs the same
            m = n + DI[k] * line + DJ[k]
            table = prices[(k & 1) * KINDS : (k & 1) * KINDS + KINDS]
            lower |= relaxed(
                (kind[n : n + width], kind[m : m + width]), (level[n : n + width], level[m : m + width]),
                moves[n : n + width], 1 << k, table, cost[n : n + width], cost[m : m + width],
            )  # fmt: skip
    return lower == 0


@xla_ffi.compiled
def relaxed(ends, heights, moves, bit, table, here, there):
    """1 if one of the moves between the cells of two rows lowers the cost of one of its ends, else 0."""
    (a, b), (low, high), lower = ends, heights, 0
    free, gate, step, unmeasured = table[LEVEL], table[IN_GATE], table[STEP], table[UNMEASURED]
    for j in range(len(moves)):  # choices in place of the table, which vectors cannot read as fast
        worse = max(a[j], b[j])
        price = gate if worse == IN_GATE else free
        price = step if (worse == STEP) | (low[j] != high[j]) else price
        price = unmeasured if worse == UNMEASURED else price
        less = (there[j] + price < here[j]) | (here[j] + price < there[j])
        lower |= (moves[j] & bit != 0) & less
    return lower
