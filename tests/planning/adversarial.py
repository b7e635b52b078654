"""Maps, goals, costs and edges with the structure on which planners go wrong, and what scipy says of them.

Maps thrown cell by cell have ways everywhere; these have few, in the places where a kernel takes a short cut: at ends
of rows, alone in a row or a column, round corners, in ties, at costs of very different size.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import scipy.sparse
from hypothesis import strategies as st
from scipy.sparse.csgraph import dijkstra

from jaxbiped.mapping.grid import Cell
from jaxbiped.planning import DIRECTIONS, Costs, Rules


def row(rng, h, w):
    """A corridor along one row."""
    free = np.zeros((h, w), bool)
    free[rng.integers(h)] = True
    return free


def column(rng, h, w):
    """A corridor along one column."""
    return row(rng, w, h).T


def hook(rng, h, w):
    """A row and a column that meet."""
    return row(rng, h, w) | column(rng, h, w)


def room_and_corridor(rng, h, w):
    """Free rows at the top or the bottom, and a corridor one cell wide that leads from them."""
    free, k = column(rng, h, w), rng.integers(1, h + 1)
    free[:k] = True
    return free[::-1] if rng.random() < 0.5 else free


def comb(rng, h, w):
    """Teeth one cell wide on a spine: goals in dead ends."""
    free = np.zeros((h, w), bool)
    free[:, rng.integers(2) :: 2] = True
    free[rng.integers(h)] = True
    return free if rng.random() < 0.5 else free[::-1, ::-1]


def serpentine(rng, h, w):
    """The longest corridor that a grid holds."""
    free = np.zeros((h, w), bool)
    free[::2] = True
    for i in range(1, h, 2):
        free[i, -1 if i % 4 == 1 else 0] = True
    return free if rng.random() < 0.5 else free[:, ::-1]


def spiral(rng, h, w):
    """A corridor that winds to the middle."""
    free, seen = np.zeros((h, w), bool), np.zeros((h + 4, w + 4), bool)
    seen[:2], seen[-2:], seen[:, :2], seen[:, -2:] = True, True, True, True
    i, j, k, turns = 0, 0, 0, 0
    while turns < 2:
        free[i, j] = seen[i + 2, j + 2] = True
        di, dj = ((0, 1), (1, 0), (0, -1), (-1, 0))[k % 4]
        a, b = i + di, j + dj
        wall = seen[a + 2, b + 2] or (seen[a + 2 + di, b + 2 + dj] and 0 <= a + di < h and 0 <= b + dj < w)
        if wall:
            k, turns = k + 1, turns + 1
        else:
            i, j, turns = a, b, 0
    return free


def diagonal(rng, h, w):
    """Cells that touch at their corners alone."""
    i, j = np.indices((h, w))
    return (i + rng.choice([-1, 1]) * j) % rng.integers(2, 4) == 0


def alone(rng, h, w):
    """A few single cells."""
    free = np.zeros((h, w), bool)
    free[rng.integers(0, h, 3), rng.integers(0, w, 3)] = True
    return free


def thrown(rng, h, w):
    """Any cells, few or many."""
    return rng.random((h, w)) < rng.uniform(0.2, 0.95)


def free_floor(rng, h, w):
    """Nothing in the way: ties everywhere."""
    return np.ones((h, w), bool)


PATTERNS = (
    row,
    column,
    hook,
    room_and_corridor,
    comb,
    serpentine,
    spiral,
    diagonal,
    alone,
    thrown,
    free_floor,
)


def one_map(rng, shape):
    """(classes, levels, goal_ij) of one map: a pattern in cells of all classes, on the flat or on steps."""
    h, w = shape
    free = PATTERNS[rng.integers(len(PATTERNS))](rng, h, w)
    kinds = [(Cell.FLOOR,), (Cell.FLOOR, Cell.GATE), (Cell.FLOOR, Cell.BUMP, Cell.GATE, Cell.UNMEASURED)]
    inside = rng.choice(kinds[rng.integers(3)], size=shape)
    outside = rng.choice([Cell.OBSTACLE, Cell.OBSTACLE, Cell.UNMEASURED])
    classes = np.where(free, inside, outside).astype(np.int8)
    levels = np.zeros(shape, int)
    ground = rng.integers(5)
    if ground == 1:  # terraces: few of the moves between rows are possible
        levels = np.add.outer(np.arange(h) * rng.integers(1, 3), np.arange(w) * rng.integers(0, 2))
    elif ground == 2:
        levels = rng.integers(0, 3, shape)
    elif ground == 3:  # the ends of what an int8 holds
        levels = rng.choice([-128, -127, 126, 127], size=shape)
    cells = np.argwhere(free) if free.any() else np.zeros((1, 2), int)
    goals = [cells[rng.integers(len(cells))], cells[0], cells[-1], rng.integers(0, shape)]
    goals += [np.array([rng.choice([-1, 0, h - 1, h]), rng.choice([-1, 0, w - 1, w])])]
    return classes, levels.clip(-128, 127).astype(np.int8), goals[rng.choice(5, p=[0.4, 0.2, 0.2, 0.1, 0.1])]


def maps(rng, shape, count):
    """Class grids [N, H, W], levels, and goals [N, 2]."""
    return tuple(np.stack(part) for part in zip(*(one_map(rng, shape) for _ in range(count)), strict=True))


def costs(rng, count):
    """Costs of all sizes from 1e-6 to 1e4, many of them zero or the same, and any rules; leaves [N]."""
    each = 10 ** rng.uniform(-6, 4, (5, count))
    each[rng.random(each.shape) < 0.1] = 0.0
    same = rng.random(count) < 0.3
    each[:, same] = np.array([1, 1, 5, 10, 100])[:, None]
    each[:, rng.random(count) < 0.1] = 1.0
    return Costs(*each.astype(np.float32)), Rules(*(rng.random(count) < 0.5 for _ in range(3)))


def edges(rng, shape, count):
    """Edge costs [N, 8, H, W] that no class grid gives: one-way, free, forbidden, a single way through all cells."""
    h, w = shape
    out = (10 ** rng.uniform(-6, 4, (count, 8, h, w))).astype(np.float32)
    out[rng.random(out.shape) < rng.choice([0.0, 0.2], (count, 1, 1, 1))] = 0.0
    out[rng.random(out.shape) < rng.choice([0.0, 0.5, 0.9], (count, 1, 1, 1))] = np.inf
    for n in np.flatnonzero(rng.random(count) < 0.3):  # there and back along the rows, one way
        out[n] = np.inf
        cost = rng.choice([0.1, 1 / 3, 1e-6, 1e4])
        out[n, 0, ::2, : w - 1] = cost
        out[n, 4, 1::2, 1:] = cost
        out[n, 2, : h - 1, w - 1] = np.where(np.arange(h - 1) % 2 == 0, cost, np.inf)
        out[n, 2, 1 : h - 1 : 2, 0] = cost
        if rng.random() < 0.5:
            out[n] = np.roll(out[n][:, ::-1, ::-1], 4, axis=0)  # upside down
    return out


@cache
def neighbours(shape):
    """Cell and neighbour of every move within a grid, as flat indices [8, H * W], and which moves stay within."""
    h, w = shape
    i, j = np.indices(shape)
    to, inside = [], []
    for di, dj in DIRECTIONS:
        a, b = i + di, j + dj
        within = (a >= 0) & (a < h) & (b >= 0) & (b < w)
        inside.append(within.ravel())
        to.append(np.where(within, a * w + b, 0).ravel())
    return np.stack(to), np.stack(inside)


def cost_to_go(edge_costs, goal_ij):
    """Fields [N, H, W] in float64 of many maps at once by scipy's Dijkstra: one graph, of which each map is a part."""
    count, _, h, w = edge_costs.shape
    to, inside = neighbours((h, w))
    flat = np.asarray(edge_costs, np.float64).reshape(count, 8, h * w)
    n, k, cell = np.nonzero(np.isfinite(flat) & inside)
    heads, tails = n * h * w + cell, n * h * w + to[k, cell]
    return fields(tails, heads, flat[n, k, cell], goal_ij, count, (1, h, w))[:, 0]


def time_to_go(time, face, turn, goal_ij):
    """Fields [N, 8, H, W] of (heading, cell) by scipy's Dijkstra, of moves and the time of a turn."""
    count, _, h, w = time.shape
    to, inside = neighbours((h, w))
    flat, faces = np.asarray(time, np.float64).reshape(count, 8, h * w), np.asarray(face).reshape(count, 8, h * w)
    n, k, cell = np.nonzero(np.isfinite(flat) & inside)
    heading = faces[n, k, cell].astype(int)
    state, size = (n * 8 + heading) * h * w, h * w
    heads, tails = [state + cell], [state + to[k, cell]]
    spent = [flat[n, k, cell]]
    n, heading, cell = (a.ravel() for a in np.indices((count, 8, size)))
    for way in (1, -1):
        heads.append((n * 8 + heading) * size + cell)
        tails.append((n * 8 + (heading + way) % 8) * size + cell)
        spent.append(np.asarray(turn, np.float64)[n])
    return fields(*map(np.concatenate, (tails, heads, spent)), goal_ij, count, (8, h, w))


def fields(tails, heads, weights, goal_ij, count, shape):
    """Least sums [N, *shape] from all layers of the goals; csr keeps zeros that are stored."""
    layers, h, w = shape
    size = layers * h * w
    graph = scipy.sparse.csr_array((weights, (tails, heads)), shape=(count * size,) * 2)
    goal_ij = np.asarray(goal_ij)
    n = np.flatnonzero(((goal_ij >= 0) & (goal_ij < [h, w])).all(1))
    cell = goal_ij[n, 0] * w + goal_ij[n, 1]
    sources = np.concatenate([n * size + layer * h * w + cell for layer in range(layers)])
    if not len(sources):
        return np.full((count, *shape), np.inf)
    return dijkstra(graph, indices=sources, min_only=True).reshape(count, *shape)


@st.composite
def problems(draw, shape, count):
    """A batch of maps with their costs, rules and goals; sometimes copies of one."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1), label="seed"))
    copies = draw(st.booleans(), label="copies of one map")
    classes, levels, goal_ij = maps(rng, shape, 1 if copies else count)
    prices, rules = costs(rng, 1 if copies else count)
    given = classes, levels, prices.__dict__, rules.__dict__, goal_ij
    if copies:
        repeat = lambda a: np.repeat(a, count, axis=0)  # noqa: E731
        each = ({k: repeat(v) for k, v in part.items()} if isinstance(part, dict) else repeat(part) for part in given)
        given = tuple(each)
    classes, levels, prices, rules, goal_ij = given
    return classes, levels, Costs(**prices), Rules(**rules), goal_ij
