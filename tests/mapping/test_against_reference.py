"""The kernels against plain NumPy (`tests.reference.mapping`) on random evidence, views and boxes: exactly equal."""

import dataclasses
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxbiped.arenas.arena import Arena, Landmarks
from jaxbiped.geometry.boxes import Boxes
from jaxbiped.geometry.pose import Pose
from jaxbiped.mapping import cobstacles, gridmap, leveling, truth
from jaxbiped.mapping.config import MapConfig
from jaxbiped.mapping.grid import Body, GridSpec
from jaxbiped.mapping.relief import Surfaces
from jaxbiped.sensing.view import View
from tests.reference import mapping as reference

SPEC = GridSpec(size_x=0.6, size_y=0.45, levels=16)
FINE = GridSpec(size_x=0.3, size_y=0.2, pitch=0.0125, lowest=0, levels=20, ground_levels=2, max_radius=0.1)
POINTS = 300
few = settings(max_examples=30, deadline=None, derandomize=True)
seeds = st.integers(0, 2**32 - 1)


def both(name, module, **static):
    """(compiled, reference) of one function of the room."""
    compiled = jax.jit(getattr(module, name), static_argnames=tuple(static))
    return partial(compiled, **static), partial(getattr(reference, name), **static)


def host(tree):
    return jax.tree.map(np.asarray, tree)


def assert_same(ours, theirs):
    for one, other in zip(jax.tree.leaves(ours), jax.tree.leaves(theirs), strict=True):
        np.testing.assert_array_equal(np.asarray(one), other)


def random_body(rng):
    numbers = rng.uniform(0, 0.16), rng.uniform(0.3, 0.5), rng.uniform(0.2, 0.4), 0.03, *rng.uniform(0, 0.02, 2)
    return Body(*(np.float32(v) for v in numbers))


def random_params(rng):
    few_points = {name: rng.choice([0.0, 2.0, 20.0]) for name in ("voxel_points", "view_points", "fused_points")}
    few_points["fused_points"] += 1
    config = MapConfig(
        **few_points,
        solid_points=rng.choice([0.0, 20.0, 100.0]),
        below_points=rng.choice([10.0, 50.0, 300.0]),
        voxel_share=rng.choice([0, 0.05, 0.5]),
        head_margin=rng.choice([0, 0.02]),
    )
    return host(config.params())


def random_evidence(rng, spec):
    evidence = rng.integers(0, 300, (*spec.shape, spec.levels)) * (rng.random((*spec.shape, spec.levels)) < 0.5)
    ground, head = slice(0, 2 - spec.lowest), slice(10 - spec.lowest, None)  # something to stand on, mostly open above
    rare = np.full(evidence.shape, rng.choice([0, 0.01]))
    rare[..., ground], rare[..., head] = 1, rng.choice([0, 0.02])
    evidence *= rng.random(evidence.shape) < rare
    evidence *= rng.random((*spec.shape, 1)) < rng.random()
    row, level = rng.integers(spec.shape[0]), rng.integers(11, 14) - spec.lowest
    evidence[row : row + 2, :, level] += rng.choice([0, 150])  # a lintel, or none
    return evidence.astype(np.float32)


def random_surfaces(rng, spec):
    """Ground heights by level, most of them near it, some of so few points that they say nothing."""
    shape = (spec.ground_levels, *spec.shape)
    pixels = rng.choice([0, 20, 200, 5000], shape).astype(np.float32)
    off = rng.normal(0, rng.choice([0.001, 0.006]), shape)
    return Surfaces(pixels, np.float32(pixels * np.clip(off, -0.015, 0.015)))


def random_view(rng, spec, pose):
    """Points inside, outside and on no voxel's face, in the robot's frame; some of them no numbers at all."""
    unit = np.array([spec.pitch, spec.pitch, spec.level_height])
    # At least 2 % of a voxel away from its faces: float32 may take the pose's sine and cosine either way.
    offset = rng.uniform([0.02, 0.02, -0.48], [0.98, 0.98, 0.48], (POINTS, 3))
    lattice = rng.integers([-2, -2, -3], [spec.shape[1] + 2, spec.shape[0] + 2, 18], (POINTS, 3))
    x, y, z = ((lattice + offset) * unit).T
    dx, dy = x - pose.x, y - pose.y
    cos, sin = np.cos(float(pose.yaw)), np.sin(float(pose.yaw))
    numbers = np.stack([cos * dx + sin * dy, cos * dy - sin * dx, z - pose.z, rng.integers(0, 4, POINTS) * 16.0])
    nasty = rng.random(numbers.shape) < 0.02
    numbers[nasty] = rng.choice([np.nan, np.inf, -np.inf, 1e30, -1.0], nasty.sum())
    return View(*numbers.astype(np.float32))


@pytest.mark.parametrize("spec", [SPEC, FINE], ids=["5 cm", "1.25 cm"])
def test_c_obstacles(spec):
    ours, theirs = both("c_obstacles", cobstacles, spec=spec)
    seen = set()

    @few
    @given(seeds)
    def check(seed):
        rng = np.random.default_rng(seed)
        evidence, surfaces = random_evidence(rng, spec), random_surfaces(rng, spec)
        args = evidence, surfaces, random_body(rng), random_params(rng)
        assert_same(got := ours(*args), theirs(*args))
        seen.update(np.unique(got[0]))

    check()
    assert seen == {1, 2, 3, 4}  # the examples reach every class


@pytest.mark.parametrize("spec", [SPEC, FINE], ids=["5 cm", "1.25 cm"])
def test_update_and_classify(spec):
    ours, theirs = both("update", gridmap, spec=spec, refit=False)
    read, read_plainly = both("classify", gridmap, spec=spec)
    mark, mark_plainly = both("mark_footprint", gridmap, spec=spec)

    @few
    @given(seeds)
    def check(seed):
        rng = np.random.default_rng(seed)
        body, params = random_body(rng), random_params(rng)
        ours_map, theirs_map = gridmap.empty(spec), reference.empty(spec)
        for _ in range(3):
            pose = Pose(
                *(np.float32(v) for v in (*rng.uniform(-0.3, 0.6, 2), rng.integers(3) * 0.03, rng.uniform(-4, 4)))
            )
            view = random_view(rng, spec, pose)
            ours_map = ours(ours_map, view, pose, body, params)
            theirs_map = theirs(theirs_map, view, pose, body, params)
            foot = float(pose.x), float(pose.y), float(rng.uniform(-0.01, 0.07)), float(body.radius)
            ours_map, theirs_map = mark(ours_map, *foot), mark_plainly(theirs_map, *foot)
        # Counts of pixels are whole numbers below 2^24 and add up exactly (footprints are 20 a cell area). Heights do
        # not.
        exact = dataclasses.replace(ours_map, surfaces=None), dataclasses.replace(theirs_map, surfaces=None)
        assert_same(*exact)
        heights = ours_map.surfaces, theirs_map.surfaces
        np.testing.assert_allclose(*(surfaces.weight for surfaces in heights), rtol=1e-5)
        np.testing.assert_allclose(*(surfaces.rise for surfaces in heights), rtol=1e-5, atol=1e-3)
        assert_same(read(ours_map, params), read_plainly(theirs_map, params))

    check()


@few
@given(seeds)
def test_truth_grid(seed):
    rng = np.random.default_rng(seed)
    slots = 5
    overhead = rng.random(slots) < 0.3
    bottom = np.where(overhead, rng.uniform(0.25, 0.45, slots), 0)
    top = bottom + rng.choice([0.012, 0.03, 0.034, 0.042, 0.06, 0.0612, 0.2, 0.9], slots)
    x, y, yaw = rng.uniform(0, 0.6, slots), rng.uniform(0, 0.45, slots), rng.uniform(-4, 4, slots)
    half_x, half_y = rng.uniform(0, 0.2, (2, slots))
    used = rng.random(slots) < 0.8
    rows = np.column_stack([x, y, yaw, half_x, half_y, bottom, top, overhead]).astype(np.float32)
    boxes = Boxes(*jnp.asarray(rows[:, :7].T), jnp.asarray(overhead), jnp.ones(slots), jnp.asarray(used))
    body = random_body(rng)
    ours = TRUTH(arena_of(boxes), spec=SPEC, body=body)
    assert_same(ours, reference.truth_grid(rows[used], SPEC, body))


TRUTH = jax.jit(truth.truth_grid, static_argnames="spec")


def arena_of(boxes):
    none = Landmarks(*(jnp.zeros(0),) * 3, jnp.zeros(0, int), jnp.zeros(0, bool))
    return Arena(jnp.ones(2), boxes, none, jnp.zeros(3), jnp.zeros(2), jnp.float32(1), jnp.int32(0), jnp.float32(0))


LEVEL = jax.jit(leveling.level_view, static_argnames="spec")


@few
@given(seeds)
def test_level_view(seed):
    rng = np.random.default_rng(seed)
    n, support = 3000, np.float32(rng.choice([0, 0.025, 0.06]))
    x, y = rng.uniform(0.15, 1.6, n), rng.uniform(-0.8, 0.8, n)
    heights = np.array([0, rng.uniform(0.01, 0.045), rng.uniform(0.045, 0.07)])
    ground = heights[rng.choice(3, n, p=rng.dirichlet(np.ones(3)))] - support
    a, b, c = rng.normal(0, [0.003, 0.02, 0.01])
    z = ground + a + b * x + c * y + rng.normal(0, 0.003, n)
    z[: n // 10] = rng.uniform(-0.2, 0.6, n // 10)
    weight = rng.integers(0, 5, n) * 16.0
    z[-1], weight[-2] = np.nan, np.inf
    view = View(*(np.float32(v) for v in (x, y, z, weight)))
    params = host(MapConfig().params())
    ours, theirs = LEVEL(view, support, params, spec=SPEC), reference.level_view(view, support, params, SPEC)
    # A point whose residual lies within a rounding error of the snap or of the gate may fall either way, and moves the
    # plane of a few thousand pixels by micrometres.
    for axis in ("x", "y", "z"):
        np.testing.assert_allclose(getattr(ours, axis), getattr(theirs, axis), atol=2e-5)


def test_no_retrace_when_numbers_change():
    traces = []

    @partial(jax.jit, static_argnames="spec")
    def step(grid_map, view, pose, body, params, spec):
        traces.append(0)
        return gridmap.update(grid_map, view, pose, body, params, spec)

    rng = np.random.default_rng(0)
    for _ in range(3):
        pose = Pose(*(np.float32(v) for v in (*rng.uniform(0, 0.5, 3),)), np.float32(0))
        body, params = random_body(rng), dataclasses.replace(random_params(rng), max_range=np.float32(rng.random()))
        step(gridmap.empty(SPEC), random_view(rng, SPEC, pose), pose, body, params, SPEC)
    assert len(traces) == 1
