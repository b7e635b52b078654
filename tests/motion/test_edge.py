"""The direction square to a bump's edge, read off the class grid."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.mapping import Cell
from jaxbiped.motion.edge import crossing_direction
from jaxbiped.planning import DIRECTIONS
from tests.reference import motion as plain

# [deg] off the true normal: at most, and in 19 of 20 directions. The grid shows an edge as stairs of whole cells, and
# none where its slope is below one cell in the window. Simulated bipeds step over edges that lie 8 degrees off and
# stumble at 12: 10 cm is too coarse a grid for bumps.
LIMITS = {0.05: (10.0, 8.0), 0.025: (5.0, 4.0), 0.1: (22.0, 20.0)}


def half_plane(angle, through_xy, pitch, size=1.0):
    """A class grid with a bump on the far side of a line: its normal is `angle`."""
    n = round(size / pitch)
    at = (np.arange(n) + 0.5) * pitch
    far = (at[None] - through_xy[0]) * np.cos(angle) + (at[:, None] - through_xy[1]) * np.sin(angle) > 0
    return np.where(far, Cell.BUMP, Cell.FLOOR).astype(np.int8), far.astype(np.int8)


def first_crossing(levels, pitch, direction, size=1.0):
    """The last floor cell before the bump, from the middle of the area on in one of the eight directions."""
    ij = np.array([levels.shape[0] // 2, levels.shape[1] // 2])
    step = DIRECTIONS[direction]
    while levels[tuple(ij)]:
        ij = ij - step
    while not levels[tuple(ij + step)]:
        ij = ij + step
    return ij, step


COMPILED = jax.jit(crossing_direction, static_argnames=("pitch",))


def crossing(classes, levels, ij, step, rise, pitch):
    arrays = (jnp.asarray(a) for a in (classes, levels, np.int32(ij), np.int32(step), np.int32(rise)))
    return float(COMPILED(*arrays, pitch=pitch))


@pytest.mark.parametrize("pitch", LIMITS)
def test_rotated_edges(pitch):
    rng = np.random.default_rng(1)
    errors = []
    for angle in np.deg2rad(np.arange(-180, 180, 3)):
        through = 0.5 + rng.uniform(-0.05, 0.05, 2)
        classes, levels = half_plane(angle, through, pitch)
        direction = int(np.round(angle / (np.pi / 4))) % 8
        ij, step = first_crossing(levels, pitch, direction)
        errors.append(np.rad2deg(plain.wrap(crossing(classes, levels, ij, step, 1, pitch) - angle)))
    worst, most = LIMITS[pitch]
    assert np.abs(errors).max() < worst
    assert np.mean(np.abs(errors) <= most) > 0.95


def test_down_is_as_up():
    """From the bump to the floor, over the same edge the other way round."""
    for degrees in (0, 20, 70, 200):
        angle = np.deg2rad(degrees)
        classes, levels = half_plane(angle, (0.5, 0.5), 0.05)
        ij, step = first_crossing(levels, 0.05, int(np.round(angle / (np.pi / 4))) % 8)
        back = crossing(classes, levels, ij + step, -step, -1, 0.05)
        assert abs(np.rad2deg(plain.wrap(back + np.pi - angle))) < LIMITS[0.05][0]


def test_agrees_with_plain_python():
    rng = np.random.default_rng(2)
    for _ in range(60):
        levels = rng.integers(0, 3, (12, 15)).astype(np.int8)
        classes = np.where(levels > 0, Cell.BUMP, Cell.FLOOR).astype(np.int8)
        classes[rng.random(classes.shape) < 0.2] = rng.choice([Cell.UNMEASURED, Cell.OBSTACLE, Cell.GATE])
        step = DIRECTIONS[rng.integers(8)]
        ij = np.array([rng.integers(1, 11), rng.integers(1, 14)])
        rise = int(np.clip(int(levels[tuple(ij + step)]) - int(levels[tuple(ij)]), -1, 1))
        if rise == 0:
            continue
        ours = crossing(classes, levels, ij, step, rise, 0.05)
        theirs = plain.crossing_direction(classes, levels, tuple(ij), step, rise, 0.05)
        assert abs(plain.wrap(ours - theirs)) < 1e-4


def test_without_an_edge_in_sight_the_move_itself():
    flat = np.full((9, 9), Cell.FLOOR, np.int8)
    for k, (di, dj) in enumerate(DIRECTIONS):
        got = crossing(flat, flat * 0, (4, 4), (di, dj), 1, 0.05)
        assert abs(plain.wrap(got - k * np.pi / 4)) < 1e-6


def test_edge_far_off_the_move_is_not_followed():
    """A move along an edge, not over it: the pattern's normal is 90 degrees off, so the move decides."""
    classes, levels = half_plane(np.pi / 2, (0.5, 0.5), 0.05)
    assert abs(crossing(classes, levels, (9, 10), (0, 1), 1, 0.05)) < 1e-6


def test_bump_at_the_rim_of_the_map():
    classes, levels = half_plane(0.0, (0.5, 0.5), 0.05)
    for i in (0, 19):
        assert abs(np.rad2deg(crossing(classes, levels, (i, 9), (0, 1), 1, 0.05))) < 15
