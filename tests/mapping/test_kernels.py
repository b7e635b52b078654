"""The compiled kernel, by which a CPU maps, against the same rules in JAX, by which other devices map: the same bits.

Both are held against plain NumPy in `test_against_reference`. Here are the inputs of nasty structure: grids of one
cell, one row, one level of ground, patches and discs of many cells; views of no point, of one voxel, of points that do
not count; evidence that is empty, tied, huge, or just at a threshold.
"""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped import mapping
from jaxbiped.geometry.pose import Pose
from jaxbiped.mapping import cobstacles, gridmap
from jaxbiped.mapping.config import MapConfig
from jaxbiped.mapping.grid import Body, Cell, GridSpec
from jaxbiped.mapping.gridmap import GridMap
from jaxbiped.mapping.relief import PlacedView, Surfaces
from jaxbiped.sensing.view import View

SPECS = {
    "usual": GridSpec(),
    "one cell": GridSpec(size_x=0.05, size_y=0.05),
    "one row": GridSpec(size_x=0.6, size_y=0.05, max_radius=0.3),
    "one column": GridSpec(size_x=0.05, size_y=0.45),
    "fine": GridSpec(size_x=0.3, size_y=0.2, pitch=0.0125, lowest=0, levels=20, ground_levels=2, max_radius=0.1),
    "coarse": GridSpec(size_x=1.2, size_y=0.8, pitch=0.1, levels=9, lowest=-3, ground_levels=1, max_radius=0.0),
    "all bits": GridSpec(size_x=0.4, size_y=0.3, levels=32, lowest=0, ground_levels=24),
    "no room": GridSpec(size_x=0.4, size_y=0.3, levels=2, lowest=0, ground_levels=1),
    "deep": GridSpec(size_x=0.2, size_y=0.2, levels=40, lowest=-8),
    "fine and deep": GridSpec(size_x=0.15, size_y=0.1, pitch=0.0125, levels=20, lowest=-8, max_radius=0.3),
}
BATCH, POINTS = 24, 64
LARGE = 64  # maps at once: XLA sums otherwise in large arrays than in small ones, unless it is told how


def nasty_counts(rng, shape):
    """Numbers of points: mostly none, else of kinds that meet thresholds: tied, just below, huge, tiny."""
    kinds = np.array([0, 1, 2, 7.2, 20, 100, 143.99, 144, 144.01, 2880, 1e-3, 1e7], np.float32)
    share = rng.choice([0.02, 0.2, 0.9])
    return np.where(rng.random(shape) < share, rng.choice(kinds, shape), 0).astype(np.float32)


def nasty_map(rng, spec):
    surfaces = nasty_counts(rng, (spec.ground_levels, *spec.shape))
    rise = surfaces * rng.choice([0, 0.0149, -0.01, 0.004, 1e-7], surfaces.shape).astype(np.float32)
    return GridMap(
        evidence=nasty_counts(rng, (*spec.shape, spec.levels)),
        votes=nasty_counts(rng, (*spec.shape, 4)),
        level_votes=nasty_counts(rng, (*spec.shape, spec.ground_levels)),
        surfaces=Surfaces(surfaces, rise),
    )


def nasty_view(rng, spec):
    """Points on the rims of cells and voxels, many of them in one voxel, some nowhere."""
    x = rng.choice([0.0, spec.pitch, spec.size_x, rng.uniform(0, spec.size_x), np.nan, np.inf, -1e-9], POINTS)
    y = rng.choice([0.0, spec.pitch, spec.size_y, rng.uniform(0, spec.size_y), -5.0], POINTS)
    z = rng.choice([0.0, 0.015, 0.03, 0.0449, 0.3, 0.5 * spec.level_height, -0.2, np.nan], POINTS)
    weight = rng.choice([0.0, 1.0, 4.0, 64.0, -1.0, np.inf], POINTS, p=[0.1, 0.3, 0.3, 0.2, 0.05, 0.05])
    if rng.random() < 0.5:
        weight *= rng.uniform(0.5, 2, POINTS)  # so that the order of a sum is seen in its last bit
    if rng.random() < 0.3:
        x[:], y[:], z[:] = x[0], y[0], z[0]
    return View(*(v.astype(np.float32) for v in (x, y, z, weight)))


def nasty_body(rng, spec):
    radius = rng.choice([0.0, spec.max_radius, spec.pitch, 0.5 * spec.pitch, 0.12])
    numbers = (
        min(radius, spec.max_radius),
        *rng.choice([0.0, 0.2, 0.36, 0.42, 2.0], 2),
        0.03,
        *rng.choice([0, 0.01], 2),
    )
    return Body(*(np.float32(v) for v in numbers))


def nasty_params(rng, below):
    choices = {
        "voxel_points": (0.0, 2.0),
        "solid_points": (0.0, 20.0, 144.0),
        "view_points": (0.0, 5.0),
        "voxel_share": (0.0, 0.05, 0.9),
        "head_margin": (0.0, 0.02),
        "height_margin": (0.0, 0.0015),
    }
    numbers = {name: float(rng.choice(values)) for name, values in choices.items()}
    config = MapConfig(**numbers, below_points=float(rng.choice([2.0, 144.0])) if below else None)
    return jax.tree.map(np.asarray, config.params())


def draw(seed, spec):
    rng = np.random.default_rng(seed)
    poses = [
        Pose(*(np.float32(v) for v in (rng.uniform(-0.1, 0.3), 0, rng.choice([0, 0.03]), 0))) for _ in range(BATCH)
    ]
    parts = (
        [nasty_map(rng, spec) for _ in range(BATCH)],
        [nasty_view(rng, spec) for _ in range(BATCH)],
        poses,
        [nasty_body(rng, spec) for _ in range(BATCH)],
        [nasty_params(rng, below=seed % 2 == 0) for _ in range(BATCH)],
    )
    return tuple(jax.tree.map(lambda *leaves: np.stack(leaves), *part) for part in parts)


def one_view(way, spec, grid_map, view, pose, body, params):
    index, counts = gridmap.voxel_of(view, pose, params, spec)
    placed = PlacedView(view, pose.z, index, counts)
    return way(grid_map, placed, cobstacles.careful(body, params), params, spec)


def class_cells(way, spec, grid_map, view, pose, body, params):
    return way(grid_map.evidence, grid_map.surfaces, cobstacles.careful(body, params), params, spec)


@pytest.mark.parametrize("name", SPECS)
def test_a_view_tells_the_same(name):
    spec = SPECS[name]
    ways = gridmap.add_view_by_kernel, gridmap.add_view_by_xla
    ours, theirs = (jax.jit(jax.vmap(partial(one_view, way, spec))) for way in ways)
    for seed in range(4):
        given = draw(seed, spec)
        for mine, other in zip(jax.tree.leaves(ours(*given)), jax.tree.leaves(theirs(*given)), strict=True):
            np.testing.assert_array_equal(mine, other)


@pytest.mark.parametrize("name", SPECS)
def test_cells_have_the_same_class(name):
    spec = SPECS[name]
    ways = cobstacles.class_by_kernel, cobstacles.class_by_xla
    ours, theirs = (jax.jit(jax.vmap(partial(class_cells, way, spec))) for way in ways)
    seen = set()
    for seed in range(4):
        given = draw(seed, spec)
        (classes, levels), (other, grounds) = ours(*given), theirs(*given)
        np.testing.assert_array_equal(classes, other)
        np.testing.assert_array_equal(levels, grounds)
        seen |= set(np.unique(classes).tolist())
    assert len(seen) > 1  # so that not all is one wall


def test_sums_have_one_order_in_large_batches():
    """Of the map that studies use, with weights that are not whole."""
    spec, rng = SPECS["usual"], np.random.default_rng(5)
    view = View(*(rng.uniform(low, high, (LARGE, 2000)).astype(np.float32) for low, high in AREA))
    grid_map = jax.vmap(lambda _: gridmap.empty(spec))(jnp.arange(LARGE))
    given = grid_map, view, Pose(*(np.zeros((4, LARGE), np.float32))), Body(0.12, 0.42, 0.36, 0.03, 0.01, 0.01)
    ways = gridmap.add_view_by_kernel, gridmap.add_view_by_xla
    ours, theirs = (
        jax.jit(jax.vmap(partial(one_view, way, spec), in_axes=(0, 0, 0, None, None)))(*given, MapConfig().params())
        for way in ways
    )
    assert float(ours.votes.max()) > 300
    for mine, other in zip(jax.tree.leaves(ours), jax.tree.leaves(theirs), strict=True):
        np.testing.assert_array_equal(mine, other)


AREA = (0, 1.8), (0, 1.4), (-0.02, 0.4), (0.5, 64)


def test_heights_that_just_do_are_told_alike():
    """At ties: the error of a height is what it may be off, to the last bit."""
    spec = GridSpec(size_x=0.1, size_y=0.05, levels=3, lowest=0, ground_levels=1, max_radius=0)
    rng, params = np.random.default_rng(0), MapConfig(height_margin=0).params()
    weight = rng.uniform(300, 4000, (2000, 1, 1, 1)).astype(np.float32) * np.ones((1, 1, 1, 2), np.float32)
    surfaces = Surfaces(weight, (weight * np.float32(0.03)).astype(np.float32))
    evidence = np.zeros((2000, 1, 2, 3), np.float32)
    evidence[..., 0] = 1000
    height = surfaces.rise[:, 0, 0, 0] / weight[:, 0, 0, 0]
    error = np.sqrt(np.square(np.float32(2) * np.float32(0.011)) / weight[:, 0, 0, 0])
    tolerance = height - error  # just what such ground is surely off
    body = Body(np.float32(0), np.float32(0.42), np.float32(0.36), np.float32(2), np.float32(0.01), tolerance)
    axes = 0, 0, Body(None, None, None, None, None, 0), None
    ours, theirs = (
        jax.jit(jax.vmap(partial(way, spec=spec), in_axes=axes))(evidence, surfaces, body, params)
        for way in (cobstacles.class_by_kernel, cobstacles.class_by_xla)
    )
    np.testing.assert_array_equal(ours[0], theirs[0])
    assert (ours[0] == Cell.FLOOR).all()  # what it may be, it is not more than


def test_batches_of_batches_and_of_none():
    """The kernel reads its batch off its arguments' ranks."""
    spec = SPECS["fine"]
    given = draw(0, spec)
    flat = jax.jit(jax.vmap(partial(one_view, gridmap.add_view, spec)))(*given)
    folded = jax.tree.map(lambda leaf: leaf.reshape(4, BATCH // 4, *leaf.shape[1:]), given)
    deep = jax.jit(jax.vmap(jax.vmap(partial(one_view, gridmap.add_view_by_kernel, spec))))(*folded)
    alone = partial(one_view, gridmap.add_view, spec)(*jax.tree.map(lambda leaf: jnp.asarray(leaf[5]), given))
    none = jax.tree.map(lambda leaf: leaf[:0], folded)
    assert jax.jit(jax.vmap(jax.vmap(partial(one_view, gridmap.add_view_by_kernel, spec))))(*none).votes.size == 0
    for whole, part, one in zip(*map(jax.tree.leaves, (flat, deep, alone)), strict=True):
        np.testing.assert_array_equal(whole, part.reshape(whole.shape))
        np.testing.assert_array_equal(whole[5], one)


def test_a_mission_on_another_device_calls_nothing_of_this_one():
    """The program that is lowered for a GPU holds no kernel of the CPU, from this machine, which has none."""
    spec = SPECS["usual"]
    given = jax.tree.map(jnp.asarray, draw(0, spec))
    update = jax.jit(jax.vmap(lambda *given: mapping.update(*given, spec=spec)))
    for platform, held in (("cuda", False), ("tpu", False), ("cpu", True)):
        text = jax.export.export(update, platforms=[platform], disabled_checks=ALL_CALLS)(*given).mlir_module()
        assert ("jaxbiped_map_update" in text) == held
    alone = jax.tree.map(lambda leaf: leaf[0], given)
    single = jax.jit(lambda *given: mapping.update(*given, spec=spec)).lower(*alone).as_text()
    assert "jaxbiped_map_update" not in single  # which takes longer to compile than one map to read


ALL_CALLS = [jax.export.DisabledSafetyCheck.custom_call("jaxbiped_map_update")]


def test_derivatives_are_those_of_the_sums():
    """Votes grow with the weights of the view's points; classes do not change."""
    spec = SPECS["usual"]
    grid_map, view, pose, body, params = jax.tree.map(lambda leaf: jnp.asarray(leaf[0]), draw(3, spec))
    view = View(*(jnp.full(3, v, jnp.float32) for v in (0.3, 0.3, 0.0, 40.0)))
    params = replace(params, refit_points=jnp.float32(1e9))

    def votes(weight, update):
        return update(grid_map, replace(view, weight=weight), pose, body, params, spec).votes.sum()

    gradient = jax.grad(votes)(view.weight, mapping.update)
    np.testing.assert_array_equal(gradient, np.ones(3))
    evidence = jax.grad(lambda e: mapping.c_obstacles(e, grid_map.surfaces, body, params, spec)[0].sum() * e.sum())
    assert np.isfinite(evidence(jnp.asarray(grid_map.evidence))).all()
