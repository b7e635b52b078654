"""Which moves a map allows, and what they cost, in a few bytes a cell: a map that settles in the cache.

The rule is `costs.move_kind`, in the form that a scalar kernel wants: a mask of the eight directions per cell, and a
table of costs by the worse of two ends.
"""

from __future__ import annotations

import numpy as np

from jaxbiped.core import xla_ffi
from jaxbiped.mapping.grid import Cell
from jaxbiped.planning.costs import DIRECTIONS, FORBIDDEN, STEP, UNMEASURED

DI, DJ = (tuple(int(d) for d in column) for column in DIRECTIONS.T)
CLASSES = len(Cell)
KINDS = FORBIDDEN + 1  # of moves
PARTS = 4  # arrays of bytes per map: `parts`


@xla_ffi.compiled
def parts(bytes, size):
    """The kind and the level of each cell, its allowed moves, one bit a direction, and room for a mark of it."""
    return bytes[:size], bytes[size : 2 * size], bytes[2 * size : 3 * size], bytes[3 * size : 4 * size]


@xla_ffi.compiled
def read_map(classes, levels, first, kinds_of, cutting, height, width, bytes):
    """Fill `parts`, grids with a ring of one cell, from the map that begins at element `first`; marks become 0.

    Args:
      classes, levels: int8, flat. kinds_of: int8 [CLASSES], the kind of a cell of each class.
      cutting: whether corners may be cut.
    """
    line, size = width + 2, (height + 2) * (width + 2)
    kind, level, moves, mark = parts(bytes, size)
    kind[:], level[:], moves[:], mark[:] = FORBIDDEN, 0, 0, 0
    for i in range(height):
        source, n = first + i * width, (i + 1) * line + 1
        for j in range(width):
            known = classes[source + j]
            kind[n + j] = kinds_of[known] if 0 <= known < CLASSES else FORBIDDEN
            level[n + j] = levels[source + j]
            moves[n + j] = kind[n + j] != FORBIDDEN
    for i in range(height):  # the first four directions, to neighbours in this row and the next
        n = (i + 1) * line + 1
        right, below, left = n + 1, n + line, n - 1
        for offset, one, two, bit in (
            (1, right, right, 1), (line + 1, right, below, 2), (line, below, below, 4), (line - 1, below, left, 8)
        ):  # fmt: skip
            ends = kind[n : n + width], kind[n + offset : n + offset + width]
            heights = level[n : n + width], level[n + offset : n + offset + width]
            sides = moves[one : one + width], moves[two : two + width]
            join(ends, heights, sides, cutting, bit, mark[n : n + width])
    for i in range(height):
        n = (i + 1) * line + 1
        own, left = mark[n : n + width], mark[n - 1 : n - 1 + width]
        above, other = mark[n - line : n - line + width], mark[n - line + 1 : n - line + 1 + width]
        corner, out = mark[n - line - 1 : n - line - 1 + width], moves[n : n + width]
        for j in range(width):  # and back
            out[j] = own[j] | (((left[j] & 1) | (corner[j] & 2) | (above[j] & 4) | (other[j] & 8)) << 4)
    mark[:] = 0


@xla_ffi.compiled
def join(ends, heights, sides, cutting, bit, found):
    """Set `bit` of each cell of a row from which a robot may go to the other end, with `sides` free or not beside it.

    Rows are arrays of their own, whose indices are never negative: so the compiler makes vectors of this loop.
    """
    (here, there), (low, high), (one, two) = ends, heights, sides
    for j in range(len(found)):
        worse, rise = max(here[j], there[j]), np.int16(low[j]) - np.int16(high[j])
        joined = (worse != FORBIDDEN) & ((worse == UNMEASURED) | ((rise >= -1) & (rise <= 1)))
        side = (one[j] | two[j]) if cutting else (one[j] & two[j])
        found[j] |= bit * (joined & (side != 0))


@xla_ffi.compiled
def move_cost(kind, level, prices, a, b, k):
    """What the allowed move in direction `k` from cell `a` to cell `b` costs; prices [2 * KINDS]."""
    worse = max(kind[a], kind[b])
    if level[a] != level[b]:
        worse = max(worse, STEP)
    return prices[(k & 1) * KINDS + worse]


@xla_ffi.compiled
def range_of(prices):
    """The least and the greatest cost that is not inf; (inf, 0) if there is none."""
    least, most = np.inf, 0.0
    for price in prices:
        if price < np.inf:
            least, most = min(least, price), max(most, price)
    return least, most
