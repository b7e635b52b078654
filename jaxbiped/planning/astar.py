"""The reference: A* with a binary heap in float64, one arena at a time (paper, 2.3)."""

from __future__ import annotations

import heapq
from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float, Int

from jaxbiped.planning.costs import DIRECTIONS
from jaxbiped.planning.path import TIE


class AStarPath(NamedTuple):
    """Cells from start to goal and their cost; no cells and inf where there is no way."""

    cells_ij: Int[np.ndarray, "L 2"]
    cost: float


def astar(
    edge_costs: Float[Array | np.ndarray, "8 H W"],
    start_ij: Int[Array | np.ndarray, "2"] | tuple[int, int],
    goal_ij: Int[Array | np.ndarray, "2"] | tuple[int, int],
    heading: int = -1,
) -> AStarPath:
    """Least path on the edge costs of one arena, in plain Python.

    It searches from the goal towards the start, so that what it settles is the cost to go, and goes on until
    all cells of equally good paths are settled; the path is then read with the tie rule of `path.pick`:
    the present heading (`heading` before the first move) if it is among the best, else the first in the
    order of `DIRECTIONS`. The heuristic is the octile distance at the least cost of a straight and of an
    oblique move; it never overrates, since two moves of one kind may do the work of the other.
    """
    edges = np.asarray(edge_costs, np.float64)
    _, height, width = edges.shape
    start, goal = tuple(int(x) for x in start_ij), tuple(int(x) for x in goal_ij)
    nowhere = AStarPath(np.zeros((0, 2), int), np.inf)
    if not all(0 <= i < height and 0 <= j < width for i, j in (start, goal)):
        return nowhere
    straight, oblique = (np.min(e, where=np.isfinite(e), initial=np.inf) for e in (edges[::2], edges[1::2]))
    straight, oblique = min(straight, oblique), min(oblique, 2 * straight)

    def heuristic(cell):
        short, far = sorted((abs(cell[0] - start[0]), abs(cell[1] - start[1])))
        return (oblique * short if short else 0.0) + (straight * (far - short) if far > short else 0.0)

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

    cells = [start]
    while cells[-1] != goal:
        i, j = cells[-1]
        ahead = {}
        for k, (di, dj) in enumerate(DIRECTIONS):
            there = (i + int(di), j + int(dj))
            # on a plateau only to what was settled before: moves that cost nothing must not lead in circles
            if there in settled and (cost[there], settled[there]) < (cost[i, j], settled[i, j]):
                ahead[k] = edges[k, i, j] + cost[there]
        best = min(ahead.values())
        good = [k for k, total in ahead.items() if total <= best * (1 + TIE)]
        heading = heading if heading in good else good[0]
        cells.append((i + int(DIRECTIONS[heading][0]), j + int(DIRECTIONS[heading][1])))
    return AStarPath(np.array(cells), cost[start])
