"""The reference: A* with a binary heap in float64, one arena at a time (paper, 2.3)."""

from __future__ import annotations

import heapq
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Int

from jaxbiped.core.checks import as_array, cells, leading_shape, whole_number
from jaxbiped.errors import InputError
from jaxbiped.planning.costs import DIRECTIONS
from jaxbiped.planning.path import TIE


class AStarPath(NamedTuple):
    """Cells from start to goal and their cost; no cells and inf if there is no path."""

    cells_ij: Int[np.ndarray, "L 2"]
    cost: float


def astar(edge_costs: Any, start_ij: Any, goal_ij: Any, heading: int = -1) -> AStarPath:
    """Lowest-cost path on the edge costs of one arena, in plain Python.

    It searches from the goal towards the start, so that it computes the cost to go, and continues until all cells of
    equally good paths are settled; the path is then read with the tie rule of `path.pick`: the present heading
    (`heading` before the first move) if it is among the best, else the first in the order of `DIRECTIONS`. The
    heuristic is the octile distance at the lowest cost of a straight and of a diagonal move; it never overestimates,
    since two moves of one kind may replace one of the other.

    Raises:
      InputError: an argument of another rank, shape or dtype, a cost that is negative or NaN, or an invalid direction.
    """
    edges = as_array("edge_costs", edge_costs)
    start, goal = cells("start_ij", start_ij), cells("goal_ij", goal_ij)
    if leading_shape(edge_costs=(edges, "8 H W"), start_ij=(start, "2"), goal_ij=(goal, "2")):
        raise InputError("must be of one arena: edge_costs [8, H, W], start_ij [2], goal_ij [2]")
    heading = whole_number("heading", heading, -1)
    if heading > 7:
        raise InputError("must be a direction from 0 to 7, or -1 for none", field="heading", value=heading)
    edges = np.asarray(edges, np.float64)
    if not (edges >= 0).all():  # also false for NaN
        raise InputError("must be 0 or more", field="edge_costs", value=float(edges[~(edges >= 0)][0]))
    height, width = edges.shape[1:]
    start, goal = tuple(start.tolist()), tuple(goal.tolist())
    nowhere = AStarPath(np.zeros((0, 2), int), np.inf)
    if not all(0 <= i < height and 0 <= j < width for i, j in (start, goal)):
        return nowhere
    straight, diagonal = (np.min(e, where=np.isfinite(e), initial=np.inf) for e in (edges[::2], edges[1::2]))
    straight, diagonal = min(straight, diagonal), min(diagonal, 2 * straight)

    def heuristic(cell):
        short, far = sorted((abs(cell[0] - start[0]), abs(cell[1] - start[1])))
        return (diagonal * short if short else 0.0) + (straight * (far - short) if far > short else 0.0)

    cost, settled = {goal: 0.0}, {}
    heap = [(heuristic(goal), goal)]
    while heap and heap[0][0] <= cost.get(start, np.inf) * (1 + TIE):
        _, cell = heapq.heappop(heap)
        if cell in settled:
            continue
        settled[cell] = len(settled)
        for k, (di, dj) in enumerate(DIRECTIONS):
            before = (cell[0] - int(di), cell[1] - int(dj))
            if 0 <= before[0] < height and 0 <= before[1] < width:
                total = cost[cell] + edges[k][before]
                if total < cost.get(before, np.inf):
                    cost[before] = total
                    heapq.heappush(heap, (total + heuristic(before), before))
    if start not in settled:
        return nowhere

    passed = [start]
    while passed[-1] != goal:
        i, j = passed[-1]
        ahead = {}
        for k, (di, dj) in enumerate(DIRECTIONS):
            there = (i + int(di), j + int(dj))
            # on a plateau only to cells settled before: moves that cost nothing must not lead in circles
            if there in settled and (cost[there], settled[there]) < (cost[i, j], settled[i, j]):
                ahead[k] = edges[k, i, j] + cost[there]
        best = min(ahead.values())
        good = [k for k, total in ahead.items() if total <= best * (1 + TIE)]
        heading = heading if heading in good else good[0]
        passed.append((i + int(DIRECTIONS[heading][0]), j + int(DIRECTIONS[heading][1])))
    return AStarPath(np.array(passed), cost[start])
