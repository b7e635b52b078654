"""What a pitch must not change: thresholds on numbers of points hold per area, so that any grid reads a scene alike."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.geometry.pose import Pose
from jaxbiped.mapping import Body, Cell, GridSpec, MapConfig, classify, empty, update
from jaxbiped.sensing.view import View

PITCHES = (0.10, 0.05, 0.025, 0.02, 0.0125)
SPACING = 0.0025  # [m] of the points: a whole number of them lies along a cell of each pitch
SIZE_X, SIZE_Y = 0.8, 0.4
BODY = Body(*(jnp.float32(v) for v in (0.04, 0.385, 0.34, 0.03, 0.002, 0.010)))
PARAMS = MapConfig(max_range=9.0).params()


@partial(jax.jit, static_argnames=("spec",))
def look(view, views, spec):
    """Classes and levels after some equal views."""

    def more(_, grid_map):
        return update(grid_map, view, Pose(*jnp.zeros(4)), BODY, PARAMS, spec, refit=False)

    return classify(jax.lax.fori_loop(0, views, more, empty(spec)), PARAMS, spec)


def read(pitch, view, views=1):
    """Classes and levels on a grid of one pitch."""
    return jax.device_get(look(view, jnp.int32(views), GridSpec(size_x=SIZE_X, size_y=SIZE_Y, pitch=pitch)))


def points(z, weight, wall=False):
    """A lattice of points on a ground of height `z(x)`, each worth so many pixels per 5 x 5 cm; a wall at its end."""
    x, y = (np.arange(round(size / SPACING)) * SPACING + SPACING / 2 for size in (SIZE_X, SIZE_Y))
    x, y = (grid.ravel() for grid in np.meshgrid(x, y))
    share = weight * (SPACING / 0.05) ** 2
    ground = x, y, z(x), np.full(len(x), share)
    above = x, y, np.full(len(x), 0.15), np.where((x > 0.7) & wall, share, 0.0)
    return View(*(jnp.asarray(np.concatenate(both), jnp.float32) for both in zip(ground, above, strict=True)))


def at(grid, pitch, x, y=0.21):
    """The cell that holds a place."""
    return int(grid[int(y / pitch), int(x / pitch)])


@pytest.mark.parametrize("pitch", PITCHES)
@pytest.mark.parametrize(
    ("pixels", "views", "measured"), [(10.5, 1, True), (9.5, 1, False), (5.5, 2, True), (4.5, 9, False)]
)
def test_enough_points_for_a_cell_are_so_per_area(pitch, pixels, views, measured):
    """Ten points in all, and five in one view, on each 5 x 5 cm (`fused_points`, `view_points`)."""
    classes, _ = read(pitch, points(np.zeros_like, pixels), views)
    assert np.all(classes == (Cell.FLOOR if measured else Cell.UNMEASURED))


@pytest.mark.parametrize("pitch", PITCHES)
def test_every_pitch_reads_the_same_ground(pitch):
    """Floor, a bump of 3 cm from 0.3 m to 0.5 m, floor, and a wall beyond 0.7 m, grown by the robot's radius."""

    def bump(x):
        return np.where((x > 0.3) & (x < 0.5), 0.03, 0.0)

    classes, levels = read(pitch, points(bump, 400.0, wall=True))
    expected = {
        0.11: Cell.FLOOR,
        0.25: Cell.FLOOR,
        0.35: Cell.BUMP,
        0.45: Cell.BUMP,
        0.55: Cell.FLOOR,
        0.75: Cell.OBSTACLE,
    }
    assert {x: at(classes, pitch, x) for x in expected} == expected
    assert at(levels, pitch, 0.45) == 1 and at(levels, pitch, 0.55) == 0
