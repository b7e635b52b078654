"""The public functions of the map refuse what they cannot use, and are right about the rest."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped import mapping
from jaxbiped.geometry.pose import Pose
from jaxbiped.mapping import Body, GridSpec, MapConfig
from jaxbiped.mapping.gridmap import voxel_of, voxelise
from jaxbiped.mapping.relief import no_surfaces
from jaxbiped.sensing.view import View
from tests import fuzzing
from tests.fuzzing import close, mapped, same, spoiled
from tests.sensing.scenes import as_jax, make

SPEC = GridSpec(size_x=0.3, size_y=0.2, levels=6, max_radius=0.1)
PARAMS = MapConfig(voxel_points=0.0, view_points=0.0, below_points=50).params()
BODY = Body(*(jnp.float32(v) for v in (0.05, 0.385, 0.34, 0.03, 0.002, 0.01)))
HERE = Pose(*(jnp.float32(v) for v in (0.0, 0.0, 0.0, 0.0)))
POINTS = np.array([[0.02, 0.02, 0.0], [0.12, 0.02, 0.03], [0.22, 0.12, 0.06], [0.28, 0.18, 0.12]], np.float32)
VIEW = View(*jnp.asarray(POINTS.T), weight=jnp.full(4, 20.0))
ARENA = as_jax(make([(0.15, 0.1, 0.0, 0.05, 0.05, 0.0, 0.03)]))
FAR = GridSpec(size_x=60.0, size_y=60.0)  # of more voxels than float32 counts


def test_bad_arguments_are_refused_and_odd_ones_are_right():
    fuzzing.run(__name__)


def cases():
    empty = mapping.empty(SPEC)
    surfaces = no_surfaces(SPEC)
    levels = {"evidence": empty.evidence, "surfaces": surfaces, "body": BODY, "params": PARAMS, "spec": SPEC}
    seen = {"grid_map": empty, "view": VIEW, "pose": HERE, "body": BODY, "params": PARAMS, "spec": SPEC, "refit": True}
    read = {"grid_map": empty, "params": PARAMS, "spec": SPEC}
    flat = {"view": VIEW, "support": jnp.float32(0.0), "params": PARAMS, "spec": SPEC}
    numbers = {name: jnp.float32(value) for name, value in {"x": 0.1, "y": 0.1, "radius": 0.05}.items()}
    stood = {"grid_map": empty, "z": jnp.float32(0.03), "spec": SPEC} | numbers
    optional = ("below_points", "movers")
    tried = {
        **spoiled("empty", mapping.empty, {"spec": SPEC}),
        **spoiled("update", mapping.update, seen, optional),
        **spoiled("classify", mapping.classify, read, optional),
        **spoiled("mark_footprint", mapping.mark_footprint, stood),
        **spoiled("level_view", mapping.level_view, flat, optional),
        **spoiled("c_obstacles", mapping.c_obstacles, levels, optional),
        **spoiled("truth_grid", mapping.truth_grid, {"arena": ARENA, "spec": SPEC, "body": BODY}, optional),
    }

    def refused(name, function, arguments, **wrong):
        tried[f"{len(tried)}: {name}({str(wrong)[:100]})"] = lambda: function(**arguments | wrong)

    for value in (np.nan, np.inf, -0.1, 0.2):
        refused("update", mapping.update, seen, body=replace(BODY, radius=value))
        refused("c_obstacles", mapping.c_obstacles, levels, body=replace(BODY, radius=np.float64(value)))
        refused("truth_grid", mapping.truth_grid, {"arena": ARENA, "spec": SPEC}, body=replace(BODY, radius=value))
    for name in ("standing", "squatting", "step", "step_tolerance", "height_tolerance"):
        refused("update", mapping.update, seen, body=replace(BODY, **{name: np.nan}))
    for name in ("voxel_points", "max_range", "refit_slope"):
        unknown = replace(PARAMS, **{name: jnp.float32(np.nan)})
        for function, arguments in ((mapping.update, seen), (mapping.classify, read), (mapping.level_view, flat)):
            refused(function.__name__, function, arguments, params=unknown)
    for value in (np.nan, np.inf):
        refused("c_obstacles", mapping.c_obstacles, levels, evidence=empty.evidence.at[0, 0, 0].set(value))
        off = replace(surfaces, rise=surfaces.rise.at[0, 0, 0].set(value))
        refused("c_obstacles", mapping.c_obstacles, levels, surfaces=off)
        refused("mark_footprint", mapping.mark_footprint, stood, z=value)
    refused("classify", mapping.classify, read, grid_map=replace(empty, votes=empty.votes - np.nan))
    for radius in (np.nan, np.inf, -0.1):
        refused("mark_footprint", mapping.mark_footprint, stood, radius=radius)
    refused("classify", mapping.classify, read, spec=GridSpec())
    for wrong in (
        {"pitch": np.nan}, {"pitch": 0}, {"pitch": "x"}, {"pitch": True}, {"size_x": np.inf}, {"levels": 6.5},
        {"levels": 60}, {"lowest": 1}, {"ground_levels": None}, {"level_height": 0.0}, {"max_radius": -1.0},
    ):  # fmt: skip
        refused("GridSpec", GridSpec, {}, **wrong)
    return tried | {
        "points that are not finite count nothing": strange_points,
        "numbers of other types are the same numbers": other_types,
        "the last voxels of a large grid are those of its points": large_grid,
        "under jit a height that is none is that of the floor": nearest_height,
        "the map is differentiable by weights": gradient,
        "vmap and scan of update, classify, mark_footprint": maps_in_batches,
        "vmap and scan of level_view, c_obstacles, truth_grid": grids_in_batches,
    }


UPDATE = jax.jit(partial(mapping.update, spec=SPEC, refit=False))


def strange_points():
    """Each axis of one point in turn, and its weight, made into what is no point of the map."""
    empty = mapping.empty(SPEC)
    without = UPDATE(empty, replace(VIEW, weight=VIEW.weight.at[1].set(0.0)), HERE, BODY, PARAMS)
    wrong = [(axis, value) for axis in "xyz" for value in (np.nan, np.inf, -np.inf, 1e30, -1e30, -0.1, 0.6)]
    wrong += [("weight", value) for value in (np.nan, np.inf, -np.inf, -5.0, 0.0)]
    for axis, value in wrong:
        view = replace(VIEW, **{axis: getattr(VIEW, axis).at[1].set(value)})
        if not same(UPDATE(empty, view, HERE, BODY, PARAMS), without):
            return axis, value
    nowhere = UPDATE(empty, VIEW, replace(HERE, yaw=jnp.float32(np.nan)), BODY, PARAMS)
    return same(nowhere, empty)


def other_types():
    double = jax.tree.map(lambda leaf: np.asarray(leaf, np.float64), (VIEW, HERE, BODY, PARAMS))
    whole = UPDATE(mapping.empty(SPEC), VIEW, Pose(0, np.uint8(0), 0, np.int64(0)), BODY, PARAMS)
    ones = UPDATE(mapping.empty(SPEC), *double)
    return same(whole, ones, UPDATE(mapping.empty(SPEC), VIEW, HERE, BODY, PARAMS))


def large_grid():
    x = 60.0 - np.array([0.02, 0.02, 0.02, 0.07, 0.12], np.float32)
    z = np.array([14, 13, 12, 14, 11], np.float32) * np.float32(FAR.level_height)
    view = View(x, np.full(5, 59.98, np.float32), z, np.arange(1, 6, dtype=np.float32))
    params = replace(PARAMS, max_range=jnp.float32(np.inf))
    points = np.asarray(jax.jit(lambda: voxelise(view, *voxel_of(view, HERE, params, FAR), FAR))())
    found = [points[1199, j, level + 1] for j, level in ((1199, 14), (1199, 13), (1199, 12), (1198, 14), (1197, 11))]
    return found == [1, 2, 3, 4, 5] and bool(points.sum() == 15)


def nearest_height():
    stand = jax.jit(lambda z: mapping.mark_footprint(mapping.empty(SPEC), 0.1, 0.1, z, 0.05, SPEC))
    levels = [np.asarray(stand(z).level_votes).any((0, 1)).argmax() for z in (9.0, 0.06, -3.0, 0.0)]
    return same(stand(np.nan), stand(np.inf), stand(0.0)) and levels == [2, 2, 0, 0]


def gradient():
    """Of all evidence by the weight of each point: 1."""

    def evidence(weight):
        return UPDATE(mapping.empty(SPEC), replace(VIEW, weight=weight), HERE, BODY, PARAMS).evidence.sum()

    return close(jax.grad(evidence)(VIEW.weight), np.ones(4))


def maps_in_batches():
    def look(shift, weight):
        here = replace(HERE, x=shift)
        first = mapping.mark_footprint(mapping.empty(SPEC), shift, 0.1, 0.03, 0.05, SPEC)
        grid_map = mapping.update(first, replace(VIEW, weight=weight), here, BODY, PARAMS, SPEC)
        return grid_map, mapping.classify(grid_map, PARAMS, SPEC)

    return mapped(look, jnp.array([0.0, 0.1]), jnp.array([[20.0] * 4, [5.0, 0.0, 30.0, 200.0]]))


def grids_in_batches():
    def read(radius, x):
        body = replace(BODY, radius=radius)
        flat = mapping.level_view(replace(VIEW, x=VIEW.x + x), 0.0, PARAMS, SPEC)
        evidence = jnp.zeros((*SPEC.shape, SPEC.levels)).at[1, 1, 4].set(500 * x)
        arena = replace(ARENA, boxes=replace(ARENA.boxes, x=ARENA.boxes.x + x))
        truth = mapping.truth_grid(arena, SPEC, body)
        return flat, mapping.c_obstacles(evidence, no_surfaces(SPEC), body, PARAMS, SPEC), truth

    return mapped(read, jnp.array([0.02, 0.1]), jnp.array([0.0, 0.05]))
