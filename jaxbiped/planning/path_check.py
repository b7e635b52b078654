"""Paths that outside planners return: whether they may be walked, their moves, and their cost by Eq. 1."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from jaxbiped.mapping.grid import Cell
from jaxbiped.planning.costs import DIRECTIONS, Costs

DIRECTION_OF = {tuple(int(d) for d in move): k for k, move in enumerate(DIRECTIONS)}
DIAGONAL = np.sqrt(2.0)
UNMEASURED, GATE, OBSTACLE = (
    int(cell) for cell in (Cell.UNMEASURED, Cell.GATE, Cell.OBSTACLE)
)  # NumPy is slow with enums
CODES = np.full((3, 3), -1, np.int8)  # of a move by (di, dj), at [di + 1, dj + 1]
for (_di, _dj), _code in DIRECTION_OF.items():
    CODES[_di + 1, _dj + 1] = _code


class PathQuery(NamedTuple):
    """What an outside planner was asked: for one map, or for a batch."""

    classes: np.ndarray  # [*B, H, W]
    levels: np.ndarray  # [*B, H, W]
    start: Any  # [*B, 2]
    goal: Any  # [*B, 2]
    costs: Any  # `Costs`, or [B, 5]
    cutting: Any  # [*B] whether corners may be cut

    def of(self, k: int) -> PathQuery:
        """That of one map of a batch."""
        classes, levels, start, goal, costs, cutting = (part[k] for part in self)
        return PathQuery(classes, levels, start, goal, Costs(*costs.tolist()), bool(cutting))


def check_paths(ways: list[Any], query: PathQuery, length: int) -> tuple[np.ndarray, np.ndarray, dict[int, str]]:
    """`check_path` of a batch at once, since one by one it takes longer than many a planner.

    Args:
      ways: the returned path of each map; None: there is none.
      query: of the batch.
      length: most moves that are kept.

    Returns:
      moves int8 [B, length], -1 after the end; costs float32 [B], NaN without a path; what is wrong with which path.
    """
    classes, levels, start, goal, costs, cutting = query
    moves = np.full((len(ways), length), -1, np.int8)
    cost, wrong = np.full(len(ways), np.nan, np.float32), {}
    paths, maps = [], []
    for k, way in enumerate(ways):
        if way is None:
            continue
        try:
            paths.append(whole_cells(way))
            maps.append(k)
        except Exception as error:  # also from converting to an array
            wrong[k] = str(error)
    if not paths:
        return moves, cost, wrong
    # Rows and columns apart, and cells by their place in all maps: arrays [N, 2] and indices of three axes take NumPy
    # several times as long.
    rows, columns = np.ascontiguousarray(np.concatenate(paths).T)
    sizes, owner = np.array([len(path) for path in paths]), np.array(maps)
    last = np.cumsum(sizes) - 1
    first = last - sizes + 1
    of_cell = np.repeat(np.arange(len(paths)), sizes)
    (height, width), ends = classes.shape[1:], np.stack([start[owner], goal[owner]])
    found = np.stack([np.stack([rows[at], columns[at]], -1) for at in (first, last)])
    bad = (found != ends).any((0, 2))
    outside = (rows < 0) | (rows >= height) | (columns < 0) | (columns >= width)
    bad[of_cell[outside]] = True
    step = np.flatnonzero((of_cell[1:] == of_cell[:-1]) & ~bad[of_cell[1:]])
    down, right = rows[step + 1] - rows[step], columns[step + 1] - columns[step]
    near = np.maximum(np.abs(down), np.abs(right)) == 1
    bad[of_cell[step[~near]]] = True
    step, down, right = step[near], down[near], right[near]
    path = of_cell[step]
    k = owner[path]
    kinds, heights = classes.ravel(), levels.ravel()
    at, below = (k * height + rows[step]) * width + columns[step], down * width
    here, there = kinds[at], kinds[at + below + right]
    unmeasured = (here == UNMEASURED) | (there == UNMEASURED)
    rise = np.abs(heights[at].astype(np.int16) - heights[at + below + right])
    diagonal = (down != 0) & (right != 0)
    sides = (kinds[at + right] == OBSTACLE).astype(np.int8) + (kinds[at + below] == OBSTACLE)
    barred = (here == OBSTACLE) | (there == OBSTACLE) | (~unmeasured & (rise > 1))
    barred |= diagonal & (sides > cutting[k])
    bad[path[barred]] = True
    gate = (here == GATE) | (there == GATE)
    event = np.where(unmeasured, 4, np.where(rise > 0, 3, np.where(gate, 2, 1)))
    price = costs.astype(np.float64)
    total = price[k, 0] * np.where(diagonal, DIAGONAL, 1.0) + price.ravel()[5 * k + event]
    total = np.bincount(path, total, len(paths))
    place = step - first[path]
    kept = ~bad[path] & (place < length)
    moves.ravel()[k[kept] * length + place[kept]] = CODES.ravel()[3 * down[kept] + right[kept] + 4]
    cost[owner[~bad]] = total[~bad]
    for n in np.flatnonzero(bad).tolist():
        k = maps[n]
        try:
            check_path(ways[k], query.of(k))
        except ValueError as error:
            wrong[k] = str(error)
    return moves, cost, wrong


def whole_cells(way) -> np.ndarray:
    """The cells [L, 2] of a path as integers.

    Raises:
      ValueError: it is no list of rows and columns.
    """
    cells = np.asarray(way)
    if cells.ndim != 2 or cells.shape[1] != 2 or len(cells) == 0 or cells.dtype.kind not in "iuf":
        raise ValueError(f"must return cells [L, 2] or None, not {cells.dtype} {list(cells.shape)}")
    if cells.dtype == np.int64:
        return cells
    with np.errstate(invalid="ignore"):  # NaN, which is not an integer
        whole = cells.astype(np.int64)
    if not np.array_equal(whole, cells):
        raise ValueError("must return whole rows and columns")
    return whole


def check_path(way, query: PathQuery) -> tuple[np.ndarray, float]:
    """The moves of one path, and its cost by Eq. 1.

    Raises:
      ValueError: what is wrong with the path.
    """
    classes, levels, start, goal, costs, cutting = query
    whole = whole_cells(way)
    if tuple(whole[0]) != tuple(start) or tuple(whole[-1]) != tuple(goal):
        ends = f"{whole[0].tolist()} to {whole[-1].tolist()}"
        raise ValueError(f"its path goes from {ends}, not from {list(map(int, start))} to {list(map(int, goal))}")
    if (whole < 0).any() or (whole >= classes.shape).any():
        raise ValueError("its path leaves the map")
    steps = np.diff(whole, axis=0)
    if (np.abs(steps).max(1, initial=0) != 1).any():
        raise ValueError("its path has cells that do not neighbour the cell before them")
    solid, cost, moves = classes == Cell.OBSTACLE, 0.0, np.zeros(len(steps), np.int8)
    for n, ((i, j), (di, dj)) in enumerate(zip(whole[:-1].tolist(), steps.tolist(), strict=True)):
        p, q = i + di, j + dj
        ends = classes[i, j], classes[p, q]
        unmeasured, rise = Cell.UNMEASURED in ends, abs(int(levels[i, j]) - int(levels[p, q]))
        if solid[i, j] or solid[p, q]:
            raise ValueError(f"its path leads through the obstacle at {[p, q] if solid[p, q] else [i, j]}")
        if not unmeasured and rise > 1:
            raise ValueError(f"its path goes up or down {rise} levels between {[i, j]} and {[p, q]}")
        sides = int(solid[i, q]) + int(solid[p, j]) if di and dj else 0
        if sides == 2 or (sides == 1 and not cutting):
            raise ValueError(f"its path cuts the corner of an obstacle between {[i, j]} and {[p, q]}")
        motion = costs.c4 if unmeasured else costs.c3 if rise else costs.c2 if Cell.GATE in ends else costs.c1
        cost += costs.c0 * (DIAGONAL if di and dj else 1.0) + motion
        moves[n] = DIRECTION_OF[di, dj]
    return moves, cost
