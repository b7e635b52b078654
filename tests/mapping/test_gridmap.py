"""The map of hand-made scenes: what the paper's Figs. 5 and 6 say must come out."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.geometry.pose import Pose, to_robot
from jaxbiped.mapping.grid import Cell, GridSpec
from jaxbiped.mapping.gridmap import classify, empty, mark_footprint, update
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


def test_stairs_are_bumps_of_two_levels():
    """Treads of 20 cm, wider than the body's radius: each step is one to its neighbour."""
    classes, levels = classes_of(
        FLOOR[FLOOR[:, 0] < 0.4],
        wall((0.4, 0.4), (0.0, 1.0), (0.0, 0.03)),
        plane((0.4, 0.6), (0.0, 1.0), 0.03),
        wall((0.6, 0.6), (0.0, 1.0), (0.03, 0.06)),
        plane((0.6, 0.8), (0.0, 1.0), 0.06),
    )
    row = classes[10, :16], levels[10, :16]
    assert row[0].tolist() == [Cell.FLOOR] * 8 + [Cell.BUMP] * 8
    assert row[1].tolist() == [0] * 8 + [1] * 4 + [2] * 4


def test_a_lone_clump_is_no_obstacle():
    """A phantom: many pixels in one voxel, in the middle of nowhere; two voxels of them are something."""
    clump = np.full((400, 3), [0.52, 0.52, 0.3])
    assert (classes_of(FLOOR, clump)[0][:20] == Cell.FLOOR).all()
    assert classes_of(FLOOR, clump, clump + np.array([0, 0, 0.03]))[0][10, 10] == Cell.OBSTACLE


def test_noise_of_a_bump_does_not_block_its_neighbours():
    rest = FLOOR[(FLOOR[:, 0] < 0.5) | (FLOOR[:, 0] > 1.0)]
    top = plane((0.5, 1.0), (0.0, 1.0), 0.03)
    top[:, 2] += np.where(np.random.default_rng(3).random(len(top)) < 0.04, 0.03, 0.0)  # 4 % one level too high
    classes, levels = classes_of(rest, top, noise=0.001)
    assert not np.isin(classes, [Cell.GATE, Cell.OBSTACLE]).any()
    assert (levels[cells((0.55, 0.95), (0, 1))] == 1).all()


def test_seen_from_a_bump_heights_are_the_worlds():
    """From level 1 the base floor lies at -3 cm, and a wall 3 cm lower than it is."""
    pose = Pose(*(jnp.float32(v) for v in (0.3, 0.5, 0.03, 0.5)))
    world = np.concatenate([FLOOR[FLOOR[:, 0] > 0.4], wall((1.2, 1.2), (0.0, 1.0), (0.0, 0.4))])
    x, y = (np.asarray(v) for v in to_robot(pose, jnp.float32(world[:, 0]), jnp.float32(world[:, 1])))
    seen = view(np.column_stack([x, y, world[:, 2] - 0.03]))
    grid_map = LOOK(empty(SPEC), seen, pose, BODY, PARAMS, spec=SPEC, refit=True)
    classes, levels = (np.asarray(v) for v in READ(grid_map, PARAMS, spec=SPEC))
    assert (classes[cells((0.5, 1.05), (0, 1))] == Cell.FLOOR).all() and not levels.any()
    assert (classes[cells((1.15, 1.2), (0, 1))] == Cell.OBSTACLE).all()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, -1e30])
@pytest.mark.parametrize("leaf", ["x", "y", "z", "weight"])
def test_bad_points_poison_nothing(leaf, bad):
    good = view(FLOOR)
    spoilt = replace(good, **{leaf: getattr(good, leaf).at[::7].set(bad)})
    kept = replace(good, weight=good.weight.at[::7].set(0))
    results = [LOOK(empty(SPEC), v, ORIGIN, BODY, PARAMS, spec=SPEC, refit=True) for v in (spoilt, kept)]
    for one, other in zip(*map(jax.tree.leaves, results), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("axis", ["x", "y", "z", "yaw"])
def test_a_pose_that_is_no_number_adds_nothing(axis):
    lost = replace(ORIGIN, **{axis: jnp.float32(np.nan)})
    grid_map = LOOK(empty(SPEC), view(FLOOR), lost, BODY, PARAMS, spec=SPEC, refit=True)
    assert all(not np.asarray(leaf).any() for leaf in jax.tree.leaves(grid_map))


def test_footprint():
    mark = jax.jit(mark_footprint, static_argnames="spec")
    classes, levels = READ(mark(empty(SPEC), 0.525, 0.525, 0.03, 0.06, SPEC), PARAMS, spec=SPEC)
    expected = np.zeros(SPEC.shape)
    expected[10, 9:12] = expected[9:12, 10] = Cell.BUMP  # 5 cm to the next centre, 7 cm to the diagonal one
    np.testing.assert_array_equal(classes, expected)
    np.testing.assert_array_equal(levels, expected > 0)
    classes, _ = READ(mark(empty(SPEC), 0.51, 0.54, 0.0, 0.0, SPEC), PARAMS, spec=SPEC)
    assert np.asarray(classes)[10, 10] == Cell.FLOOR and np.asarray(classes).sum() == Cell.FLOOR
    for place in ((-1.0, 0.5), (np.nan, 0.5), (0.5, np.inf)):
        assert not np.asarray(mark(empty(SPEC), *place, 0.0, 0.05, SPEC).votes).any()


@pytest.mark.parametrize("pitch", [0.1, 0.025])
def test_other_pitches_read_the_same_world(pitch):
    spec = GridSpec(pitch=pitch)
    world = np.concatenate([FLOOR[FLOOR[:, 0] < 0.9], wall((0.9, 0.9), (0.0, 1.0), (0.0, 0.3))])
    grid_map = LOOK(empty(spec), view(world), ORIGIN, BODY, PARAMS, spec=spec, refit=False)
    classes = np.asarray(READ(grid_map, PARAMS, spec=spec)[0])
    height = round(1.0 / pitch)
    assert (classes[:height, : round(0.7 / pitch)] == Cell.FLOOR).all()
    near = slice(int(np.ceil(0.82 / pitch)), round(0.9 / pitch))
    assert (classes[:height, near] == Cell.OBSTACLE).all() and not classes[height:].any()


def test_one_cell():
    spec = GridSpec(size_x=0.05, size_y=0.05)
    grid_map = LOOK(empty(spec), view(plane((0, 0.05), (0, 0.05), 0.03)), ORIGIN, BODY, PARAMS, spec=spec, refit=False)
    classes, levels = READ(grid_map, PARAMS, spec=spec)
    assert classes.tolist() == [[Cell.BUMP]] and levels.tolist() == [[1]]


def far_wall(points):
    """A wall whose upper levels have points enough to bar the way, and whose lower ones have some."""
    lower, upper = wall((0.92, 0.92), (0.3, 0.7), (0.045, 0.345)), wall((0.92, 0.92), (0.3, 0.7), (0.345, 0.5))
    grid_map = empty(SPEC)
    for part, weight in ((FLOOR, 16.0), (lower, 4.0), (upper, 16.0)):  # 15 points a voxel: 60 and 240 pixels
        grid_map = LOOK(grid_map, view(part, weight), ORIGIN, BODY, points, spec=SPEC, refit=False)
    again = LOOK(grid_map, view(FLOOR, 64.0), ORIGIN, BODY, points, spec=SPEC, refit=False)
    return np.asarray(READ(again, points, spec=SPEC)[0])[cells((0.85, 0.95), (0.35, 0.65))]


def test_the_foot_of_a_far_wall_is_no_gate():
    assert (far_wall(PARAMS) == Cell.GATE).all()
    assert (far_wall(replace(PARAMS, below_points=jnp.float32(50))) == Cell.OBSTACLE).all()


def test_what_hangs_free_stays_a_gate():
    """Few points below a lintel, and a gap between: the rule for walls leaves it alone."""
    params = replace(PARAMS, below_points=jnp.float32(50))
    stray = wall((0.92, 0.92), (0.3, 0.7), (0.20, 0.29))
    grid_map = empty(SPEC)
    for part, weight in ((np.concatenate(gate(0.37)), 16.0), (stray, 4.0), (FLOOR, 64.0)):
        grid_map = LOOK(grid_map, view(part, weight), ORIGIN, BODY, params, spec=SPEC, refit=False)
    assert (np.asarray(READ(grid_map, params, spec=SPEC)[0])[cells((0.85, 1.0), (0.35, 0.65))] == Cell.GATE).all()
