"""Planning on one arena in plain NumPy and heapq: edge costs, Dijkstra from the goal, moves read off the field.

Costs are summed in double precision; ties are broken by the package's rule.
"""

from __future__ import annotations

import heapq

import numpy as np

from jaxbiped.mapping.grid import Cell
from jaxbiped.planning import DIRECTIONS
from jaxbiped.planning.path import TIE


def edge_costs(classes, levels, costs, rules):
    """Cost of leaving each cell in each direction, [8, H + 2, W + 2] with a blocked ring; inf where forbidden."""
    classes = np.pad(classes, 1, constant_values=Cell.OBSTACLE)
    levels = np.pad(levels.astype(int), 1)
    blocked = classes == Cell.OBSTACLE
    if not rules.bumps:
        blocked |= classes == Cell.BUMP
    if not rules.gates:
        blocked |= classes == Cell.GATE
    c0, c1, c2, c3, c4 = (float(c) for c in (costs.c0, costs.c1, costs.c2, costs.c3, costs.c4))
    out = np.full((8, *classes.shape), np.inf)
    here = slice(1, -1), slice(1, -1)
    height, width = classes.shape
    for k, (di, dj) in enumerate(DIRECTIONS):

        def at(array, a, b):
            return array[1 + a : height - 1 + a, 1 + b : width - 1 + b]

        forbidden = blocked[here] | at(blocked, di, dj)
        rise = np.abs(levels[here] - at(levels, di, dj))
        unmeasured = (classes[here] == Cell.UNMEASURED) | (at(classes, di, dj) == Cell.UNMEASURED)
        forbidden |= (rise > 1) & ~unmeasured
        if di and dj:
            side_a, side_b = at(blocked, di, 0), at(blocked, 0, dj)
            forbidden |= (side_a & side_b) if rules.corner_cutting else (side_a | side_b)
        gate = (classes[here] == Cell.GATE) | (at(classes, di, dj) == Cell.GATE)
        motion = np.where(unmeasured, c4, np.where(rise == 1, c3, np.where(gate, c2, c1)))
        distance = c0 * np.sqrt(2) if di and dj else c0
        out[k, 1:-1, 1:-1] = np.where(forbidden, np.inf, distance + motion)
    return out


def dijkstra(edges, goal_ij, until_ij):
    """Cost to go of every cell, [H + 2, W + 2]; it stops when `until_ij` is settled, the rest is then too high.

    That is enough for reading a path from there, since paths only go downhill.
    """
    _, height, width = edges.shape
    leave = edges.reshape(8, -1).tolist()
    offsets = [int(di) * width + int(dj) for di, dj in DIRECTIONS]
    goal, until = ((i + 1) * width + j + 1 for i, j in (goal_ij, until_ij))
    cost = [np.inf] * (height * width)
    cost[goal] = 0.0
    heap = [(0.0, goal)]
    into = [(-offsets[k], leave[k]) for k in range(8)]  # a move in direction k comes from the cell behind
    while heap:
        reached, cell = heapq.heappop(heap)
        if reached > cost[cell]:
            continue
        if cell == until:
            break
        for back, leaving in into:
            near = cell + back
            if not 0 <= near < len(cost):
                continue
            total = reached + leaving[near]
            if total < cost[near]:
                cost[near] = total
                heapq.heappush(heap, (total, near))
    return np.array(cost).reshape(height, width)


def next_moves(field, edges, ij, heading, count):
    """The first `count` directions of the path from a cell; -1 after its end."""
    moves = [-1] * count
    i, j = ij[0] + 1, ij[1] + 1
    for step in range(count):
        ahead = {}
        for k, (di, dj) in enumerate(DIRECTIONS):
            total = edges[k, i, j] + field[i + di, j + dj] if np.isfinite(edges[k, i, j]) else np.inf
            if np.isfinite(total) and field[i + di, j + dj] < field[i, j]:
                ahead[k] = total
        if not ahead:
            break
        best = min(ahead.values())
        good = [k for k, total in ahead.items() if total <= best * (1 + TIE)]
        heading = heading if heading in good else good[0]
        moves[step] = heading
        i, j = i + DIRECTIONS[heading][0], j + DIRECTIONS[heading][1]
    return moves
