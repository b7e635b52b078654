"""Least-cost paths on one map, one query at a time: A* on the host, which looks at a part of the map only."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from jaxtyping import Float64, Int, Int8

from jaxbiped.core import xla_ffi
from jaxbiped.core.checks import cells
from jaxbiped.errors import InputError
from jaxbiped.planning import kernels
from jaxbiped.planning.arguments import grid_arguments, indices
from jaxbiped.planning.cost_field import field, valid_tables
from jaxbiped.planning.costs import DIRECTIONS, STEP, Costs, Rules, edge_costs
from jaxbiped.planning.kernels import map_astar, map_moves
from jaxbiped.planning.path import TIE, read_path


@dataclass(frozen=True)
class ShortestPath:
    """A path of least cost, on the host."""

    cells_ij: Int[np.ndarray, "L1 2"]  # from start to goal
    directions: Int8[np.ndarray, "L"]  # move from cell k to cell k + 1
    so_far: Float64[np.ndarray, "L1"]  # cost by Eq. 1 up to each cell, summed from the start
    cost: float  # by Eq. 1, summed from the goal and rounded to float32 like fields
    expanded: int  # cells of which neighbours were looked at


class PathSearch:
    """One map, read once, on which paths are then searched. Queries from several threads wait for each other.

    Paths and costs are those of `field` and `read_path`, bit for bit, ties included: A* settles as much of the field as
    the path is read from (Hart, Nilsson and Raphael 1968; the estimate is the cost on an empty map of one class). Where
    moves cost nothing, and where costs are so uneven that the order of the search fits them badly, the whole field is
    settled.

    Args:
      classes, levels: [H, W], as for `field`.
      costs, rules: scalars, as for `field`; the paper's by default.

    Raises:
      InputError: an argument of another rank, shape or dtype, or a value out of range; a negative cost or NaN; inside
        `jit`, `vmap` or `scan`.
    """

    def __init__(self, classes: Any, levels: Any, costs: Costs | None = None, rules: Rules | None = None):
        batch, given = grid_arguments(classes, levels, costs or Costs(), rules or Rules())
        refuse_traced("classes, levels, costs and rules", given)
        if batch:
            raise InputError("must be one map [H, W]", field="classes", value=list(np.shape(classes)))
        self.classes, self.levels, self.costs, self.rules = jax.tree.map(lambda leaf: np.asarray(leaf)[0], given)
        if not all(cost >= 0 for cost in jax.tree.leaves(self.costs)):
            raise InputError("must not be negative or NaN", field="costs", value=self.costs)
        self.shape = self.classes.shape
        self._lock, (kinds, prices, cutting) = threading.Lock(), map(np.asarray, valid_tables(given[2:])[0])
        self._prices = np.ascontiguousarray(prices[0], np.float32)
        self._rooms = [np.empty(size, dtype) for size, dtype in map_astar.rooms(*self.shape)]
        self._classes = np.ascontiguousarray(self.classes, np.int8)
        levels = np.ascontiguousarray(self.levels, np.int8)
        name, _ = kernels.target("read")
        xla_ffi.call(name, (self._classes, levels, np.ascontiguousarray(kinds[0], np.int8), cutting), self._rooms)

    def path(self, start_ij: Any, goal_ij: Any, heading: Any = -1) -> ShortestPath | None:
        """The path of least cost; None if there is none.

        Args:
          start_ij, goal_ij: [2], integers, row and column; outside the map there is no path.
          heading: direction of the move before the first, -1 for none: of equally good moves it is kept.

        Raises:
          InputError: an argument of another shape or dtype, or a heading that is not a direction.
        """
        refuse_traced("heading", heading)
        heading = int(indices("heading", heading))
        answer, cost, expanded, moves = self._search(start_ij, goal_ij, heading)
        if answer == map_astar.ABANDONED:
            return self._whole(start_ij, goal_ij, heading)
        if answer == map_astar.NONE:
            return None
        return self._path(np.asarray(start_ij), moves, cost, expanded)

    def cost(self, start_ij: Any, goal_ij: Any) -> float:
        """The least cost by Eq. 1, inf without a path; arguments as for `path`."""
        answer, cost, *_ = self._search(start_ij, goal_ij, map_astar.COST_ONLY)
        if answer == map_astar.ABANDONED:
            found = self._whole(start_ij, goal_ij, -1)
            return np.inf if found is None else found.cost
        return cost

    def _search(self, start_ij, goal_ij, heading: int) -> tuple[int, float, int, Int8[np.ndarray, "L"]]:
        """Answer of the kernel, cost, expanded cells and moves."""
        ends = [self._cell("start_ij", start_ij), self._cell("goal_ij", goal_ij)]
        if not all(((end >= 0) & (end < self.shape)).all() for end in ends):
            return map_astar.NONE, np.inf, 0, np.zeros(0, np.int8)
        given = np.array([*ends[0], *ends[1], heading], np.int32)
        wanted = 0 if heading == map_astar.COST_ONLY else self.classes.size
        moves, cost, told = np.empty(wanted, np.int8), np.empty(1), np.empty(3, np.int64)
        name, _ = kernels.target("search")
        arguments = self._prices, np.array([1 + TIE], np.float32), given, self._classes
        with self._lock:
            xla_ffi.call(name, arguments, (moves, cost, told, *self._rooms))
        length, answer, expanded = told.tolist()
        with np.errstate(over="ignore"):  # beyond float32 it is inf, as in a field
            rounded = float(cost.astype(np.float32)[0])
        return answer, rounded, expanded, moves[:length].copy()

    def _cell(self, name: str, value) -> Int[np.ndarray, "2"]:
        refuse_traced(name, value)
        found = np.asarray(cells(name, value))
        if found.shape != (2,):
            raise InputError("must be one cell [2]", field=name, value=list(found.shape))
        return found

    def _whole(self, start_ij, goal_ij, heading: int) -> ShortestPath | None:
        """`path`, off the whole field."""
        grids = self.classes, self.levels, self.costs, self.rules
        to_go = field(*grids, np.asarray(goal_ij))
        path = read_path(to_go, edge_costs(*grids), np.asarray(start_ij), self.classes.size, heading)
        if not bool(path.valid):
            return None
        moves = np.asarray(path.directions)[: int(path.length)]
        return self._path(np.asarray(start_ij), moves, float(path.cost), self.classes.size)

    def _path(self, start_ij, moves: Int8[np.ndarray, "L"], cost: float, expanded: int) -> ShortestPath:
        """The path of these moves, each with its price."""
        cells_ij = np.cumsum(np.concatenate([start_ij.astype(np.int64)[None], DIRECTIONS[moves]]), 0)
        grid = (map_moves.PARTS, *(size + 2 for size in self.shape))
        kind, level, *_ = (part[tuple(cells_ij.T + 1)] for part in self._rooms[0].reshape(grid))
        worse = np.maximum(kind[1:], kind[:-1])
        worse = np.where(level[1:] != level[:-1], np.maximum(worse, STEP), worse)
        prices = self._prices[moves % 2, worse].astype(np.float64)
        return ShortestPath(cells_ij, moves, np.concatenate([[0.0], np.cumsum(prices)]), cost, expanded)


def refuse_traced(name: str, value: Any) -> None:
    """Raise `InputError` inside `jit`, `vmap` and `scan`, where a search cannot run."""
    if any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(value)):
        message = "must be concrete, since a search runs on the host; inside jit, vmap and scan use field and read_path"
        raise InputError(message, field=name)


def shortest_path(
    classes: Any,
    levels: Any,
    costs: Costs | None = None,
    rules: Rules | None = None,
    *,
    start_ij: Any,
    goal_ij: Any,
    heading: Any = -1,
) -> ShortestPath | None:
    """One query of a `PathSearch`, which keeps the map where there are more."""
    return PathSearch(classes, levels, costs, rules).path(start_ij, goal_ij, heading)
