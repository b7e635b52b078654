"""Costs along edges of the ground, against plain Python, and the paths that come of them."""

import math

import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped import planning
from jaxbiped.mapping import Cell
from jaxbiped.planning.edge_clearance import HIGHER, LOWER, RAGGED, TOES, rim_costs

DIRECTIONS = [tuple(int(d) for d in direction) for direction in planning.DIRECTIONS]


def plain(classes, levels, pitch):
    """[8, H, W] by loops over cells, moves and all cells around."""
    height, width = classes.shape
    out = np.zeros((8, height, width))

    def ground(i, j):
        inside = 0 <= i < height and 0 <= j < width and classes[i, j] in (Cell.FLOOR, Cell.BUMP)
        return int(levels[i, j]) if inside else None

    def price(table, beside):
        return next((cost for within, cost in table if beside <= within), 0.0)

    for k, (di, dj) in enumerate(DIRECTIONS):
        length = math.hypot(di, dj)
        for i, j in np.ndindex(height, width):
            here, there = ground(i, j), ground(i + di, j + dj)
            if here is None or there is None:
                continue
            walk, ragged = 0.0, 0.0
            for a, b in np.ndindex(15, 15):
                oi, oj = a - 7, b - 7
                other = ground(i + oi, j + oj)
                along = ((oi - di / 2) * di + (oj - dj / 2) * dj) / length * pitch
                beside = abs((oi - di / 2) * dj - (oj - dj / 2) * di) / length * pitch
                past = abs(along) - length * pitch / 2
                if other is None or beside < 1e-3 or past > TOES + 1e-3:
                    continue
                if past > 1e-3:
                    ahead = ground(i + 2 * di, j + 2 * dj) if along > 0 else ground(i - di, j - dj)
                    if other > here and not (ahead is not None and ahead > here):
                        walk = max(walk, price(HIGHER, beside))
                    continue
                if other != here:
                    walk = max(walk, price(HIGHER if other > here else LOWER, beside))
                if beside <= RAGGED[-1][0]:
                    near = {here} if along < -1e-3 else {there} if along > 1e-3 else {here, there}
                    ragged += price(RAGGED, beside) * (other not in near)
            out[k, i, j] = walk * length * pitch / 0.05 if here == there else ragged
    return out


@pytest.mark.parametrize("pitch", [0.05, 0.025, 0.1])
def test_agrees_with_plain_python(pitch):
    rng = np.random.default_rng(3)
    kinds = rng.choice([0, 1, 1, 1, 2, 2, 3, 4], (3, 9, 10)).astype(np.int8)
    levels = np.where(kinds == Cell.BUMP, rng.integers(1, 3, kinds.shape), 0).astype(np.int8)
    ours = np.asarray(rim_costs(jnp.asarray(kinds), jnp.asarray(levels), pitch))
    for b in range(3):
        np.testing.assert_allclose(ours[b], plain(kinds[b], levels[b], pitch), atol=1e-4)


def test_move_costs_what_the_move_back_costs():
    rng = np.random.default_rng(4)
    kinds = rng.choice([1, 1, 2], (1, 12, 12)).astype(np.int8)
    costs = np.asarray(rim_costs(jnp.asarray(kinds), jnp.asarray((kinds == 2).astype(np.int8)), 0.05))[0]
    for k, (di, dj) in enumerate(DIRECTIONS[:4]):
        back = costs[k + 4][max(di, 0) : 12 + min(di, 0), max(dj, 0) : 12 + min(dj, 0)]
        there = costs[k][max(-di, 0) : 12 + min(-di, 0), max(-dj, 0) : 12 + min(-dj, 0)]
        np.testing.assert_allclose(there, back, atol=1e-5)


def path(bump_rows, bump_columns, start, goal):
    kinds = np.ones((1, 20, 24), np.int8)
    kinds[0, bump_rows, bump_columns] = Cell.BUMP
    levels = (kinds == Cell.BUMP).astype(np.int8)
    costs = planning.edge_costs(kinds, levels) + rim_costs(jnp.asarray(kinds), jnp.asarray(levels), 0.05)
    found = planning.read_path(
        planning.cost_to_go(costs, np.array([goal])), costs, np.array([start]), 60, heading=np.array([0])
    )
    return np.asarray(found.cells_ij[0])[: int(found.length[0]) + 1], levels[0]


def test_flat_ground_costs_nothing_more():
    floor = jnp.ones((1, 8, 8), jnp.int8)
    assert not np.asarray(rim_costs(floor, jnp.zeros((1, 8, 8), jnp.int8), 0.05)).any()


def test_straight_edge_is_crossed_at_no_more_cost():
    kinds = np.ones((1, 20, 24), np.int8)
    kinds[0, :, 10:16] = Cell.BUMP
    levels = (kinds == Cell.BUMP).astype(np.int8)
    costs = np.asarray(rim_costs(jnp.asarray(kinds), jnp.asarray(levels), 0.05))[0]
    assert not costs[0, 10, :23].any() and costs[2, 10, 9] > 0


def test_way_round_keeps_two_cells_off():
    cells, levels = path(slice(8, 12), slice(10, 14), (9, 3), (9, 20))
    edge = np.argwhere(levels > 0)
    away = 0.05 * np.linalg.norm(cells[:, None] - edge, axis=-1).min()
    assert (levels[tuple(cells.T)] == 0).all() and away > 0.11  # half a cell less: 8.5 cm, and feet take 7.5


def test_long_bump_is_crossed_square_and_in_its_middle():
    cells, levels = path(slice(3, 17), slice(10, 15), (10, 3), (10, 20))
    assert levels[tuple(cells.T)].max() == 1 and (cells[:, 0] == 10).all()
