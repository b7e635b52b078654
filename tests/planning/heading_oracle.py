"""What planning over (cell, heading) is compared with: moves by plain loops, Dijkstra by heapq, one arena."""

from __future__ import annotations

import heapq
import math

import numpy as np

from jaxbiped.mapping.grid import Cell
from jaxbiped.planning import DIRECTIONS
from tests.planning import oracle
from tests.reference.motion import crossing_direction, wrap

EIGHTH = math.pi / 4
FREE = (1, 1, 1, 1, 1)  # costs of Eq. 1 that tell forbidden moves from others


def moves(classes, levels, times, pitch=0.05, **rules):
    """(time [8, H, W], face [8, H, W]) move by move, as the clock of a mission counts them."""
    allowed = np.isfinite(oracle.edge_costs(classes, levels, FREE, **rules))
    time, face = np.full(allowed.shape, np.inf), np.zeros(allowed.shape, int)
    for k, i, j in np.argwhere(allowed):
        di, dj = (int(d) for d in DIRECTIONS[k])
        ends = {classes[i, j], classes[i + di, j + dj]}
        rise = int(levels[i + di, j + dj]) - int(levels[i, j])
        cells = math.hypot(di, dj) * pitch / 0.05
        share = times.measure / max(1, round(0.05 / pitch))
        face[k, i, j] = k
        if Cell.UNMEASURED in ends:
            time[k, i, j] = cells * times.straight + share + times.measure + times.unmeasured * pitch / 0.05
        elif rise:
            square = crossing_direction(classes, levels, (i, j), (di, dj), rise, pitch)
            off = round(wrap(square - k * EIGHTH) / EIGHTH)
            face[k, i, j] = (k + off) % 8
            ahead, aside = cells * math.cos(off * EIGHTH), cells * abs(math.sin(off * EIGHTH))
            walked = max(ahead - math.sqrt(2), 0) + aside
            step = times.step_up if rise > 0 else times.step_down
            time[k, i, j] = step + walked * times.straight + times.measure
        else:
            time[k, i, j] = cells * (times.pass_gate if Cell.GATE in ends else times.straight) + share
    return time, face


def time_to_go(time, face, turn, goal_ij):
    """Field [8, H, W] of (heading, cell)."""
    into = {}  # (face, cell) -> moves that lead there
    for k, i, j in np.argwhere(np.isfinite(time)):
        di, dj = DIRECTIONS[k]
        into.setdefault((face[k, i, j], i + di, j + dj), []).append((face[k, i, j], i, j, time[k, i, j]))
    field = np.full(time.shape, np.inf)
    heap = [(0.0, h, *goal_ij) for h in range(8)]
    while heap:
        total, h, i, j = heapq.heappop(heap)
        if total >= field[h, i, j]:
            continue
        field[h, i, j] = total
        for way in (1, -1):
            heapq.heappush(heap, (total + turn, (h + way) % 8, i, j))
        for f, a, b, spent in into.get((h, i, j), ()):
            heapq.heappush(heap, (total + spent, f, a, b))
    return field
