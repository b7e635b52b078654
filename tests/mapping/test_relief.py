"""Heights of the ground as the map measures them: off any grid, on any pitch, and what can be stood on."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.mapping import MapConfig, classify, empty, ground_height, update
from jaxbiped.mapping.cobstacles import ground_level as level_of
from jaxbiped.mapping.cobstacles import occupied_levels, solid_levels
from jaxbiped.mapping.grid import Cell, GridSpec
from jaxbiped.mapping.relief import greatest_within, read_relief
from tests.mapping.scenes import BODY, ORIGIN, plane, view, wall

PARAMS = MapConfig(max_range=9.0).params()
PITCHES = (0.10, 0.05, 0.025, 0.02, 0.0125)
SIZE = {"size_x": 0.8, "size_y": 0.4}
SPEC = GridSpec(**SIZE)


@partial(jax.jit, static_argnames="spec")
def look(seen, spec=SPEC):
    """Classes, levels and relief after two looks at the same, and the map: the first tells a top from its face."""
    grid_map = empty(spec)
    for _ in range(2):
        grid_map = update(grid_map, seen, ORIGIN, BODY, PARAMS, spec, refit=False)
    columns = occupied_levels(grid_map.evidence, PARAMS, spec)
    solid = solid_levels(columns, grid_map.evidence, PARAMS, spec)
    ground = level_of(columns, grid_map.evidence, spec)
    relief = read_relief(grid_map.surfaces, ground, columns, solid, PARAMS, spec)
    return *classify(grid_map, PARAMS, spec), relief, grid_map


def bar(top, first=0.3, last=0.5, noise=0.002, step=0.006):
    """A floor with a bar of a height across it: the bar's top, and the face towards the robot."""
    floor = plane((0, 0.8), (0, 0.4), 0.0, step)
    floor = floor[(floor[:, 0] < first) | (floor[:, 0] > last)]
    parts = [floor, plane((first, last), (0, 0.4), top, step), wall((first, first), (0, 0.4), (0, top), step)]
    points = np.concatenate(parts)
    points[:, 2] += noise * np.random.default_rng(0).normal(size=len(points))
    return view(points, 64.0)


def column_of(values, pitch, x, y=0.21):
    return np.asarray(values)[int(y / pitch), int(x / pitch)]


@pytest.mark.parametrize("pitch", PITCHES)
@pytest.mark.parametrize("top", [0.012, 0.02, 0.025, 0.03, 0.036, 0.042, 0.055, 0.06])
def test_the_height_of_a_surface_is_its_own_on_every_pitch(top, pitch):
    *_, relief, _ = look(bar(top), spec=GridSpec(**SIZE, pitch=pitch))
    assert column_of(relief.height, pitch, 0.44) == pytest.approx(top, abs=0.001)
    assert column_of(relief.height, pitch, 0.11) == pytest.approx(0.0, abs=0.001)


@pytest.mark.parametrize("offset", np.arange(0.0, 0.05, 0.0062))
@pytest.mark.parametrize("top", [0.025, 0.03, 0.04])
def test_a_face_anywhere_in_a_cell_lowers_no_top_and_lifts_no_floor(offset, top):
    """Cells with an edge in them are told neither for lower nor for higher than what is on both sides of it."""
    classes, levels, relief, _ = look(bar(top, 0.3 + offset, 0.5 + offset))
    highest = np.asarray(relief.top).max()
    assert highest == pytest.approx(top, abs=0.0015)
    beside = np.asarray(classes)[:, 5]  # floor, within the body's radius of the bar
    assert (beside == (Cell.OBSTACLE if top > 0.032 else Cell.FLOOR)).all()
    if top <= 0.032:
        assert not np.isin(classes, [Cell.OBSTACLE, Cell.GATE]).any() and np.asarray(levels).max() == 1


@pytest.mark.parametrize("width", [0.03, 0.05, 0.07])
@pytest.mark.parametrize("offset", [0.0, 0.015, 0.025, 0.04])
def test_a_bar_as_narrow_as_a_cell_is_as_high_as_it_is(width, offset):
    first = 0.3 + offset
    for top, kind in ((0.03, Cell.FLOOR), (0.04, Cell.OBSTACLE)):
        classes = np.asarray(look(bar(top, first, first + width))[0])
        assert (classes[:, 5] == kind).all(), top


GROUNDS = {  # height of a bar: class of the floor beside it, and of the bar
    0.005: (Cell.FLOOR, Cell.FLOOR),
    0.008: (Cell.FLOOR, Cell.FLOOR),
    0.012: (Cell.FLOOR, Cell.OBSTACLE),
    0.015: (Cell.FLOOR, Cell.OBSTACLE),
    0.018: (Cell.FLOOR, Cell.OBSTACLE),
    0.022: (Cell.FLOOR, Cell.BUMP),
    0.030: (Cell.FLOOR, Cell.BUMP),
    0.034: (Cell.OBSTACLE, Cell.BUMP),
    0.040: (Cell.OBSTACLE, None),  # could be stood on, if there were a way
    0.045: (Cell.OBSTACLE, None),
    0.060: (Cell.OBSTACLE, Cell.BUMP),
}


@pytest.mark.parametrize("top", GROUNDS)
def test_what_can_be_stepped_on_goes_by_its_height(top):
    classes = np.asarray(look(bar(top, 0.3, 0.6))[0])
    beside, on_it = GROUNDS[top]
    assert (classes[:, 5] == beside).all()
    assert on_it is None or (classes[:, 8:10] == on_it).all()
    assert (classes[:, :3] == Cell.FLOOR).all()


def stair(lower, upper):
    """Classes of a stair of two steps, along the way."""
    parts = [
        plane((0, 0.2), (0, 0.4), 0.0, 0.006),
        plane((0.2, 0.5), (0, 0.4), lower, 0.006),
        plane((0.5, 0.8), (0, 0.4), upper, 0.006),
        wall((0.2, 0.2), (0, 0.4), (0, lower), 0.006),
        wall((0.5, 0.5), (0, 0.4), (lower, upper), 0.006),
    ]
    return np.asarray(look(view(np.concatenate(parts), 64.0))[0])[4]


def test_a_stair_goes_by_the_height_between_its_steps():
    """Of 2.6 and 5.2 cm each is a step; 3.1 and 5.1 cm are both near a level, and 2 cm apart; 2.4 and 5.9 are 3.5."""
    assert (stair(0.026, 0.052)[4:] == Cell.BUMP).all()
    first = stair(0.022, 0.0595)  # 3.75 cm from one to the other
    assert (first[4:7] == Cell.BUMP).all() and (first[8:10] == Cell.OBSTACLE).all()
    second = stair(0.036, 0.0515)  # 1.55 cm: a step of 3 cm would end in the air
    assert (second[9:11] == Cell.OBSTACLE).any()


def test_few_points_do_not_make_ground_untenable():
    """Far off a cell holds few pixels, and what they tell of its height may be an error."""
    near, far = bar(0.014, 0.3, 0.6), bar(0.014, 0.3, 0.6)
    far = replace(far, weight=far.weight / 64 * 0.4)
    assert (np.asarray(look(near)[0])[:, 7:11] == Cell.OBSTACLE).all()
    assert not (np.asarray(look(far)[0]) == Cell.OBSTACLE).any()


def test_height_in_one_cell_alone_is_a_mixture():
    points = np.concatenate([plane((0, 0.8), (0, 0.4), 0.0, 0.006), plane((0.4, 0.45), (0.2, 0.25), 0.04, 0.006)])
    lone = look(view(points, 64.0))[0]
    assert (np.asarray(lone)[:, :7] == Cell.FLOOR).all()
    more = np.concatenate([points, plane((0.4, 0.45), (0.15, 0.2), 0.04, 0.006)])
    assert np.asarray(look(view(more, 64.0))[0])[4, 6] == Cell.OBSTACLE


@pytest.mark.parametrize("pitch", PITCHES)
@pytest.mark.parametrize("above", [0.004, 0.013])
def test_few_points_along_an_edge_are_a_mixture(above, pitch):
    """Past the far edge of a bump a matcher leaves points in the air; they made the floor there an obstacle."""

    def classes(weight):
        """With points that hang 2.5 cm wide behind a bump, each of which weighs so much."""
        hung = plane((0.5, 0.525), (0, 0.4), 0.03 + above, 0.006)
        ground = [plane((0, 0.3), (0, 0.4), 0.0, 0.006), plane((0.5, 0.8), (0, 0.4), 0.0, 0.006)]
        ground += [plane((0.3, 0.5), (0, 0.4), 0.03, 0.006), wall((0.3, 0.3), (0, 0.4), (0, 0.03), 0.006)]
        ground = np.concatenate(ground)
        seen = view(np.concatenate([ground, hung]), 64.0)
        weights = np.concatenate([np.full(len(ground), 64.0), np.full(len(hung), weight)])
        seen = replace(seen, weight=seen.weight.at[: len(weights)].set(weights))
        return np.asarray(look(seen, spec=GridSpec(**SIZE, pitch=pitch))[0])

    assert not np.isin(classes(5.0), [Cell.OBSTACLE, Cell.GATE]).any()  # as many as were seen in missions: 4 %
    floor = int(0.6 / pitch)
    assert above < 0.01 or (classes(64.0)[1:-1, floor] == Cell.OBSTACLE).all()  # a bar of its own


@pytest.mark.parametrize("shape", [(1, 1, 1), (2, 1, 7), (1, 9, 1), (3, 5, 4), (2, 28, 36)])
def test_the_greatest_within_a_reach(shape):
    planes = np.random.default_rng(0).choice([-np.inf, -1.0, 0.0, 0.5, 1e30], shape).astype(np.float32)
    reach_of = jax.jit(greatest_within, static_argnums=1)
    for reach in (1, 2, 3, 4, 5, 13, 40):
        expected = np.full(shape, -np.inf, np.float32)
        for k, i, j in np.ndindex(shape):
            expected[k, i, j] = planes[k, max(i - reach, 0) : i + reach + 1, max(j - reach, 0) : j + reach + 1].max()
        np.testing.assert_array_equal(reach_of(planes, reach), expected)


def test_a_robot_stands_as_high_as_its_ground_was_measured():
    *_, grid_map = look(bar(0.025))
    read = partial(ground_height, grid_map, spec=SPEC)
    assert read(jnp.array([4, 8]), jnp.float32(0.03)) == pytest.approx(0.025, abs=0.0005)
    assert read(jnp.array([4, 2]), jnp.float32(0.0)) == 0.0
    assert read(jnp.array([4, 2]), jnp.float32(0.03)) == pytest.approx(0.03)  # nothing was measured at that level
