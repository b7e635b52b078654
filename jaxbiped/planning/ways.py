"""Helpers for planners of other libraries: the free cells for planners without levels, and the cells along a line."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int, Int8

from jaxbiped.mapping.grid import Cell
from jaxbiped.planning.costs import DIRECTIONS


def free_cells(
    classes: Int8[np.ndarray, "H W"], levels: Int8[np.ndarray, "H W"], start_ij: tuple[int, int]
) -> Bool[np.ndarray, "H W"]:
    """Cells between which all moves are allowed, for planners that consider cells instead of moves.

    These are cells that are not obstacles, and at most one level above any neighbour. The robot's own cell is always
    free.
    """
    free = classes != Cell.OBSTACLE
    known = free & (classes != Cell.UNMEASURED)
    height, width = classes.shape
    wide, there = np.pad(levels.astype(int), 1), np.pad(known, 1)
    for di, dj in DIRECTIONS:
        beside = slice(1 + di, 1 + di + height), slice(1 + dj, 1 + dj + width)
        free &= ~(known & there[beside] & (levels - wide[beside] > 1))
    free[start_ij] = True
    return free


def cells_along(points_ij: Sequence[Sequence[float]] | Float[np.ndarray, "n 2"]) -> Int[np.ndarray, "L 2"]:
    """The cells that a line through points crosses, each adjacent to the one before, never diagonally.

    Args:
      points_ij: row and column, as reals; cell (i, j) reaches from i to i + 1 and from j to j + 1.
    """
    points = np.asarray(points_ij, float)
    cells = [tuple(int(v) for v in np.floor(points[0]))]
    for a, b in itertools.pairwise(points):
        crossings = []
        for axis in (0, 1):
            # A point on the line between two cells belongs to the upper one: going down from it crosses the line.
            low, high = sorted((a[axis], b[axis]))
            lines = np.arange(np.floor(low) + 1, np.floor(high) + 1)
            way = 1 if b[axis] > a[axis] else -1
            crossings += [((line - a[axis]) / (b[axis] - a[axis]), axis, way) for line in lines]
        for _, axis, way in sorted(crossings):
            cell = list(cells[-1])
            cell[axis] += way
            cells.append(tuple(cell))
    return np.array(cells)
