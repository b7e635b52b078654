"""Fast marching of the library `scikit-fmm` (pip install scikit-fmm): arrival times of a wave from the goal."""

import numpy as np
import skfmm

from jaxbiped import DIRECTIONS, Cell, free_cells


def fast_marching(classes, levels, start_ij, goal_ij, costs):
    """Cells from the start down the arrival times, which the wave runs through at 1 over the cost of a cell."""
    motion = np.select([classes == Cell.UNMEASURED, classes == Cell.GATE], [costs.c4, costs.c2], costs.c1)
    free = free_cells(classes, levels, start_ij)
    if not free[goal_ij]:
        return None
    front = np.ma.MaskedArray(np.ones(classes.shape), ~free)
    front[goal_ij] = -1
    time = np.ma.filled(skfmm.travel_time(front, 1.0 / (costs.c0 + motion)), np.inf)
    time[goal_ij] = -1.0
    way, moves = [start_ij], [tuple(int(v) for v in move) for move in DIRECTIONS]
    while way[-1] != goal_ij:
        i, j = way[-1]
        best, there = time[i, j], None
        for di, dj in moves:
            p, q = i + di, j + dj
            inside = 0 <= p < free.shape[0] and 0 <= q < free.shape[1]
            if inside and free[p, q] and free[i, q] and free[p, j] and time[p, q] < best:
                best, there = time[p, q], (p, q)
        if there is None:
            return None
        way.append(there)
    return way
