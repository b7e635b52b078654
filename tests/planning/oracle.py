"""What the planning tests compare with: edge costs by plain loops, fields by scipy's Dijkstra, random maps."""

from __future__ import annotations

import numpy as np
import scipy.sparse
from scipy.sparse.csgraph import dijkstra

from jaxbiped.mapping.grid import Cell
from jaxbiped.planning import DIRECTIONS


def edge_costs(classes, levels, costs=(1, 1, 5, 10, 100), corner_cutting=False, bumps=True, gates=True):
    """Edge costs [8, H, W] of one arena, cell by cell, as the paper's 2.3 says it."""
    height, width = classes.shape
    c0, c1, c2, c3, c4 = costs
    out = np.full((8, height, width), np.inf)

    def blocked(i, j):
        c = classes[i, j]
        return c == Cell.OBSTACLE or (c == Cell.BUMP and not bumps) or (c == Cell.GATE and not gates)

    for i in range(height):
        for j in range(width):
            for k, (di, dj) in enumerate(DIRECTIONS):
                a, b = i + di, j + dj
                if not (0 <= a < height and 0 <= b < width) or blocked(i, j) or blocked(a, b):
                    continue
                ends = {classes[i, j], classes[a, b]}
                rise = 0 if Cell.UNMEASURED in ends else abs(int(levels[i, j]) - int(levels[a, b]))
                sides = int(blocked(a, j)) + int(blocked(i, b)) if di and dj else 0
                if rise > 1 or sides == 2 or (sides == 1 and not corner_cutting):
                    continue
                motion = c4 if Cell.UNMEASURED in ends else c3 if rise else c2 if Cell.GATE in ends else c1
                out[k, i, j] = c0 * (np.sqrt(2) if di and dj else 1) + motion
    return out


def graph(edges):
    """The sparse graph of edge costs [8, H, W], turned round: from a cell to those that can move into it."""
    _, height, width = edges.shape
    cell = np.arange(height * width).reshape(height, width)
    heads, tails, weights = [], [], []
    for k, (di, dj) in enumerate(DIRECTIONS):
        i, j = np.nonzero(np.isfinite(edges[k]))
        inside = (i + di >= 0) & (i + di < height) & (j + dj >= 0) & (j + dj < width)
        i, j = i[inside], j[inside]
        heads.append(cell[i, j])
        tails.append(cell[i + di, j + dj])
        weights.append(edges[k, i, j])
    heads, tails, weights = map(np.concatenate, (heads, tails, weights))
    # scipy takes a stored zero for no edge at all in some of its routines, but csr with explicit zeros is kept
    return scipy.sparse.csr_array((weights.astype(float), (tails, heads)), shape=(height * width,) * 2)


def cost_to_go(edges, goal_ij):
    """Field [H, W] in float64 by scipy's Dijkstra."""
    _, height, width = edges.shape
    return dijkstra(graph(edges), indices=goal_ij[0] * width + goal_ij[1]).reshape(height, width)


def random_grids(rng, batch, height, width, blocked=0.25):
    """Classes and levels of any kind, thrown cell by cell: nastier than any real map."""
    rest = (1 - blocked) * np.array([0.1, 0.65, 0.15, 0.1])
    classes = rng.choice(5, size=(batch, height, width), p=[*rest, blocked])
    levels = np.where(classes == Cell.FLOOR, 0, rng.integers(0, 3, classes.shape))
    return classes.astype(np.int8), levels.astype(np.int8)


def maze(rng, height, width, loops=0):
    """Passable cells [height, width] of a maze with corridors of one cell, dug depth first, with extra holes."""
    passable = np.zeros((height, width), bool)
    passable[0, 0] = True
    stack = [(0, 0)]
    while stack:
        i, j = stack[-1]
        steps = [(a, b) for a, b in ((0, 2), (2, 0), (0, -2), (-2, 0))]
        steps = [(a, b) for a, b in steps if 0 <= i + a < height and 0 <= j + b < width and not passable[i + a, j + b]]
        if not steps:
            stack.pop()
            continue
        a, b = steps[rng.integers(len(steps))]
        passable[i + a // 2, j + b // 2] = passable[i + a, j + b] = True
        stack.append((i + a, j + b))
    if loops:
        passable[rng.integers(0, height, loops), rng.integers(0, width, loops)] = True
    return passable
