"""Cost-to-go by Dijkstra's method with a binary heap, compiled for a CPU, one arena after the other, in float64.

Cells are settled once, so that neither the size nor the shape of a map can make it slow: for large maps, and for few.
"""

from __future__ import annotations

import heapq

import numpy as np
from numba import njit

from jaxbiped.planning.costs import DIRECTIONS

DI, DJ = (tuple(int(d) for d in column) for column in DIRECTIONS.T)


@njit(nogil=True)
def solve_arena(edges, goals, cost, arena, height, width, batch, half):
    """Settle arena number `arena`; arrays as in `line_sweep`, where `cost` is 0 at the goal and inf elsewhere."""
    line = width + 2
    offsets = np.array([DI[k] * line + DJ[k] for k in range(8)])
    heap = [(0.0, 0)]
    heap.pop()
    goal = (goals[arena, 0] + 1) * line + goals[arena, 1] + 1
    if 0 <= goal < (height + 2) * line and cost[goal * batch + arena] == 0.0:  # inside the grid
        heap.append((0.0, goal))
    while heap:
        so_far, n = heapq.heappop(heap)
        if so_far > cost[n * batch + arena]:
            continue
        for k in range(8):
            # the move that leads here from a neighbour is made in direction k by the cell at n - offset
            m = n - offsets[k]
            at = n if half and k >= 4 else m  # half: the cost of a move back stands in the cell that it leads to
            new = so_far + edges[k][at * batch + arena]
            if new < cost[m * batch + arena]:
                cost[m * batch + arena] = new
                heapq.heappush(heap, (new, m))
    return 1
