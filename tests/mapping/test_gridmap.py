"""The map of hand-made scenes: what the paper's Figs. 5 and 6 say must come out."""

import jax
import numpy as np
import pytest

from jaxbiped.mapping.grid import Cell
from jaxbiped.mapping.gridmap import classify, empty, update
from tests.mapping.scenes import BODY, ORIGIN, PARAMS, SPEC, plane, view, wall

LOOK = jax.jit(update, static_argnames=("spec", "refit"))
READ = jax.jit(classify, static_argnames="spec")
FLOOR = plane((0.0, 1.8), (0.0, 1.0), 0.0)


def classes_of(*parts, noise=0.0):
    points = np.concatenate(parts)
    points = points + noise * np.random.default_rng(0).normal(size=points.shape)
    grid_map = LOOK(empty(SPEC), view(points), ORIGIN, BODY, PARAMS, spec=SPEC, refit=False)
    return tuple(np.asarray(v) for v in READ(grid_map, PARAMS, spec=SPEC))


def cells(x, y):
    """Slice of the cells whose centres lie in a rectangle."""
    return tuple(slice(int(np.ceil(a / 0.05 - 0.5)), int(np.floor(b / 0.05 + 0.5))) for a, b in (y, x))


def test_nothing_seen_is_unmeasured():
    classes, levels = READ(empty(SPEC), PARAMS, spec=SPEC)
    assert not np.any(classes) and not np.any(levels)


def test_floor_is_floor_and_the_rest_unmeasured():
    classes, levels = classes_of(FLOOR)
    assert (classes[:20] == Cell.FLOOR).all() and not classes[20:].any() and not levels.any()


@pytest.mark.parametrize(("top", "level"), [(0.03, 1), (0.06, 2)])
def test_islands_that_can_be_stood_on(top, level):
    rest = FLOOR[(FLOOR[:, 0] < 0.5) | (FLOOR[:, 0] > 1.0)]
    classes, levels = classes_of(rest, plane((0.5, 1.0), (0.0, 1.0), top), noise=0.002)
    assert (classes[cells((0.55, 0.95), (0, 1))] == Cell.BUMP).all()
    assert (levels[cells((0.55, 0.95), (0, 1))] == level).all()
    beside = classes[cells((0.4, 0.5), (0, 1))]  # within the body's radius of the edge
    assert (beside == (Cell.FLOOR if level == 1 else Cell.OBSTACLE)).all()
    assert (classes[cells((0.0, 0.35), (0, 1))] == Cell.FLOOR).all()


@pytest.mark.parametrize("top", [0.09, 0.15, 0.3, 0.6])
def test_walls_and_low_obstacles_block_all_within_the_radius(top):
    classes, _ = classes_of(
        FLOOR[FLOOR[:, 0] < 0.9],
        wall((0.9, 0.9), (0.0, 1.0), (0.0, top)),
        plane((0.9, 1.0), (0.0, 1.0), top),
        noise=0.003,
    )
    assert (classes[cells((0.8, 0.95), (0, 1))] == Cell.OBSTACLE).all()
    assert (classes[cells((0.0, 0.75), (0, 1))] == Cell.FLOOR).all()


def gate(clearance):
    """A lintel across x = 0.9 .. 1.0 and its two posts, with the floor below."""
    return (
        FLOOR,
        wall((0.9, 0.9), (0.2, 0.8), (clearance, 0.5)),
        plane((0.9, 1.0), (0.2, 0.8), clearance),
        wall((0.9, 0.9), (0.0, 0.2), (0.0, 0.5)),
        wall((0.9, 0.9), (0.8, 1.0), (0.0, 0.5)),
    )


@pytest.mark.parametrize(
    ("clearance", "expected"),
    [(0.30, Cell.OBSTACLE), (0.37, Cell.GATE), (0.42, Cell.FLOOR)],
    ids=["low", "37 cm", "high"],
)
def test_lintels(clearance, expected):
    classes, _ = classes_of(*gate(clearance), noise=0.004)
    assert (classes[cells((0.85, 1.0), (0.35, 0.65))] == expected).all()
    assert (classes[cells((0.85, 0.9), (0.0, 0.2))] == Cell.OBSTACLE).all()
    assert (classes[cells((0.0, 0.75), (0, 1))] == Cell.FLOOR).all()


def test_a_near_view_does_not_outvote_the_lintel_that_it_cannot_see():
    grid_map = empty(SPEC)
    for points, weight in ((np.concatenate(gate(0.37)), 8.0), (FLOOR, 400.0)):
        grid_map = LOOK(grid_map, view(points, weight), ORIGIN, BODY, PARAMS, spec=SPEC, refit=False)
    classes, _ = READ(grid_map, PARAMS, spec=SPEC)
    assert (np.asarray(classes)[cells((0.85, 1.0), (0.35, 0.65))] == Cell.GATE).all()
