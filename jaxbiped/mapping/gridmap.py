"""The map: views accumulate as 3D evidence, points vote for classes, the majority decides (paper, 2.2, Figs. 5-7)."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.core import checks
from jaxbiped.core.batching import by_batch_size, by_platform
from jaxbiped.core.signatures import checked
from jaxbiped.geometry.pose import Pose, to_world
from jaxbiped.mapping.cobstacles import MANY, careful, class_by_xla, kernel_settings
from jaxbiped.mapping.fading import Eye, forget
from jaxbiped.mapping.grid import Body, Cell, GridSpec, check_body, flat_index
from jaxbiped.mapping.leveling import level_view
from jaxbiped.mapping.params import MapParams
from jaxbiped.mapping.relief import PlacedView, Surfaces, add_surfaces, no_surfaces, surface_share
from jaxbiped.sensing.view import View

AS_GOOD = 0.003  # [m] off its level, up to which the ground that a robot stands on is taken to be at it
FOOTPRINT_POINTS = 20.0  # points and votes, on a cell of 5 x 5 cm, that standing on it is worth


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class GridMap:
    """What all views of one mission have given so far. Leaves are float32 counts of pixels."""

    evidence: Float[Array, "*B H W Z"]  # points in each voxel
    votes: Float[Array, "*B H W 4"]  # for floor, bump, gate and obstacle: `Cell` less one
    level_votes: Float[Array, "*B H W G"]  # for each ground level
    surfaces: Surfaces  # how high the ground is within each of them


@checked()
def empty(spec: GridSpec) -> GridMap:
    """The map of one arena before the first view."""
    return GridMap(
        evidence=jnp.zeros((*spec.shape, spec.levels)),
        votes=jnp.zeros((*spec.shape, 4)),
        level_votes=jnp.zeros((*spec.shape, spec.ground_levels)),
        surfaces=no_surfaces(spec),
    )


@checked(numbers=("grid_map", "body", "params"))
def update(
    grid_map: GridMap,
    view: View,
    pose: Pose,
    body: Body,
    params: MapParams,
    spec: GridSpec,
    refit: bool = True,
    eye: Eye | None = None,
) -> GridMap:
    """The map after one more view of one arena.

    `pose` is where the robot believes to stand, `pose.z` [m] the height of its supporting surface. With `refit`
    (static) the view is first brought level by the floor that it sees. Its points then accumulate in the 3D grid, the
    cells are classed from the evidence of all views so far (`c_obstacles`), and each point of this view votes for the
    class, and for the ground level, of its cell. With `eye`, what this view makes old fades first (`mapping.fading`).

    Interpretation of the paper: a cell's class in a view is read from the 3D grid accumulated so far (Fig. 5), not from
    that view's points alone. A near view cannot see the lintel that earlier views saw, and would out-vote them.
    Deviations, found necessary on rendered stereo: voxels and cells with very few points do not count (`MapConfig`).

    Points that are not finite, beyond `params.max_range` or outside the grid count nothing.

    Under `jit`, where values are not known, a NaN in `body` or `params` compares false, and a radius beyond
    `spec.max_radius` is cut to that.

    Raises:
      InputError: an argument of another rank, shape or type, a body that `grid.check_body` refuses, NaN in `grid_map`,
        `body` or `params`.
    """
    check_body(body, spec)
    if refit:
        view = level_view(view, pose.z, params, spec)
        # Without this the compiler solves for the plane again at every point (a third of the time of an update).
        view = jax.lax.optimization_barrier(view)
    index, counts = voxel_of(view, pose, params, spec)
    if eye is not None:
        points = without_few(voxelise(view, index, counts, spec), params, spec)
        grid_map = forget(grid_map, view, points, pose, eye, spec)
    return add_view(grid_map, PlacedView(view, pose.z, index, counts), careful(body, params), params, spec)


@partial(jax.custom_jvp, nondiff_argnums=(4,))
def add_view(grid_map: GridMap, placed: PlacedView, body: Body, params: MapParams, spec: GridSpec) -> GridMap:
    """The map of one arena after what one more view tells.

    Batches of `MANY` maps are read by a compiled kernel on a CPU; smaller ones, and all on other devices, by XLA. The
    results are the same, bit for bit, where the numbers are finite and none is negative.

    Args:
      body: the careful one (`cobstacles.careful`).
    """
    by_kernel, by_xla = (partial(way, spec=spec) for way in (add_view_by_kernel, add_view_by_xla))
    add = by_batch_size(by_xla, by_platform(by_kernel, by_xla), MANY)
    return add(grid_map, placed, body, params)


@add_view.defjvp
def add_view_jvp(spec, primals, tangents):
    """Derivatives of the sums of points; classes do not change with them."""
    return jax.jvp(partial(add_view_by_xla, spec=spec), primals, tangents)


def add_view_by_xla(grid_map, placed, body, params, spec):
    """`add_view` in JAX."""
    points = without_few(voxelise(placed.view, placed.index, placed.counts, spec), params, spec)
    count = functools.reduce(jnp.add, jnp.unstack(points, axis=-1))  # in this order, which a sum leaves to XLA
    count = jnp.where(count >= params.view_points * spec.cell_share, count, 0.0)
    surfaces = add_surfaces(grid_map.surfaces, placed, params, spec)
    evidence = grid_map.evidence + points
    classes, levels = class_by_xla(evidence, surfaces, body, params, spec)
    return add_votes(replace(grid_map, evidence=evidence, surfaces=surfaces), count, classes, levels)


def add_view_by_kernel(grid_map, placed, body, params, spec):
    """`add_view` by machine code."""
    from jaxbiped.mapping.kernels import map_update  # with Numba, which takes a second to import

    maps = grid_map.evidence, grid_map.votes, grid_map.level_votes, grid_map.surfaces
    view, index = placed.view, jnp.where(placed.counts, placed.index, -1)
    points = index, view.weight, surface_share(view, params), view.z + placed.z
    evidence, votes, level_votes, weight, rise, *_ = map_update.add_view(
        maps, points, *kernel_settings(body, params, spec), spec
    )
    return GridMap(evidence=evidence, votes=votes, level_votes=level_votes, surfaces=Surfaces(weight, rise))


def voxel_of(view: View, pose: Pose, params: MapParams, spec: GridSpec) -> tuple[Int[Array, "N"], Bool[Array, "N"]]:
    """Index of the voxel of each point of one view, as of a flat grid, and whether it counts; else 0."""
    (height, width), depth = spec.shape, spec.levels
    x, y = to_world(pose, view.x, view.y)
    column = jnp.floor(x / spec.pitch)
    row = jnp.floor(y / spec.pitch)
    voxel = jnp.round((view.z + pose.z) / spec.level_height) - spec.lowest
    # Comparisons with NaN are false: whatever is not finite fails one of these.
    counts = (view.weight > 0) & (view.weight < jnp.inf) & (view.x**2 + view.y**2 < params.max_range**2)
    counts &= (row >= 0) & (row < height) & (column >= 0) & (column < width) & (voxel >= 0) & (voxel < depth)
    index = flat_index(counts, (row, column, voxel), (height, width, depth))
    return index, counts


def voxelise(view: View, index: Int[Array, "N"], counts: Bool[Array, "N"], spec: GridSpec) -> Float[Array, "H W Z"]:
    """Pixels of one view in each voxel: one scatter."""
    (height, width), depth = spec.shape, spec.levels
    flat = jnp.zeros(height * width * depth)
    flat = flat.at[index].add(jnp.where(counts, view.weight, 0.0), mode="promise_in_bounds")
    return flat.reshape(height, width, depth)


def without_few(points: Float[Array, "H W Z"], params: MapParams, spec: GridSpec) -> Float[Array, "H W Z"]:
    """Pixels of one view, where a voxel with too few of them has none."""
    return jnp.where(points >= params.voxel_points * spec.cell_share, points, 0.0)


def add_votes(
    grid_map: GridMap, count: Float[Array, "H W"], classes: Int[Array, "H W"], levels: Int[Array, "H W"]
) -> GridMap:
    """The map after `count` more points of each cell have voted for its class and its ground level."""
    kinds = jnp.arange(1, 5, dtype=jnp.int8)
    grounds = jnp.arange(grid_map.level_votes.shape[-1], dtype=jnp.int8)
    count = count[..., None]
    return replace(
        grid_map,
        votes=grid_map.votes + jnp.where(classes[..., None] == kinds, count, 0.0),
        level_votes=grid_map.level_votes + jnp.where(levels[..., None] == grounds, count, 0.0),
    )


@checked(numbers=("grid_map", "params"))
def classify(grid_map: GridMap, params: MapParams, spec: GridSpec) -> tuple[Int[Array, "H W"], Int[Array, "H W"]]:
    """Classes (int8, `Cell`) and ground levels (int8) of one arena: the majority of all votes.

    A cell with fewer than `params.fused_points` votes is unmeasured. A tie goes to the class that is harder to cross.
    A floor cell has level 0 and a bump cell the raised level with most votes; others have the level with most votes
    (a tie goes to the lower). Under `jit` NaN compares false. Both are integers: for derivatives, use `grid_map.votes`.

    Raises:
      InputError: an argument of another rank, shape or type, or with NaN.
    """
    votes = [grid_map.votes[..., k] for k in range(4)]
    level_votes = [grid_map.level_votes[..., k] for k in range(spec.ground_levels)]
    measured = sum(votes) >= params.fused_points * spec.cell_share
    classes = jnp.where(measured, 4 - first_greatest(votes[::-1]), Cell.UNMEASURED)
    level = first_greatest(level_votes)
    raised = 1 + first_greatest(level_votes[1:]) if spec.ground_levels > 1 else level
    level = jnp.where(classes == Cell.BUMP, raised, level)
    level = jnp.where((classes == Cell.FLOOR) | ~measured, 0, level)
    return classes.astype(jnp.int8), level.astype(jnp.int8)


def first_greatest(values: list[Float[Array, "H W"]]) -> Int[Array, "H W"]:
    """Index of the first greatest of a few arrays, cell by cell; an `argmax` of so short an axis is not vectorised."""
    best, index = values[0], jnp.zeros(values[0].shape, jnp.int32)
    for k, value in enumerate(values[1:], 1):
        index, best = jnp.where(value > best, k, index), jnp.maximum(best, value)
    return index


@checked(numbers=("grid_map", "radius"))
def mark_footprint(
    grid_map: GridMap,
    x: Float[Array, ""] | float,
    y: Float[Array, ""] | float,
    z: Float[Array, ""] | float,
    radius: Float[Array, ""] | float,
    spec: GridSpec,
) -> GridMap:
    """The map after the robot has stood at (x, y) [m] on ground of height `z` [m]: what it stands on is known ground.

    Cells whose centre lies within `radius` [m], and the one that holds the point, get `FOOTPRINT_POINTS` of evidence at
    that height, and as many votes: for floor at level 0, else for bump. A place that is not finite, or outside the
    grid, marks nothing beyond the rim. Under `jit` a height that is not finite counts as 0, and one above the highest
    ground level as of that level.

    Raises:
      InputError: an argument of another rank, shape or type, a height that is not finite, a radius out of range, NaN in
        `grid_map`.
    """
    checks.finite("z", z)
    checks.finite("radius", radius, 0.0)
    rows, columns = (jnp.arange(n) for n in spec.shape)
    dx, dy = (columns + 0.5) * spec.pitch - x, ((rows + 0.5) * spec.pitch - y)[:, None]
    own = jnp.maximum(jnp.abs(dx), jnp.abs(dy)) <= spec.pitch / 2
    here = own | (dx**2 + dy**2 <= jnp.square(radius))
    count = jnp.where(here, FOOTPRINT_POINTS * spec.cell_share, 0.0)
    z = jnp.asarray(z, jnp.float32)
    z = jnp.where(jnp.isfinite(z), z, 0.0)
    level = jnp.clip(jnp.round(z / spec.level_height), 0, spec.ground_levels - 1).astype(jnp.int8)
    on_level = jnp.where(jnp.arange(spec.ground_levels)[:, None, None] == level, count, 0.0)
    surfaces = Surfaces(
        grid_map.surfaces.weight + on_level,
        grid_map.surfaces.rise + on_level * (z - level * jnp.float32(spec.level_height)),
    )
    at_level = jnp.arange(spec.levels) + spec.lowest == level
    evidence = grid_map.evidence + jnp.where(at_level, count[..., None], 0.0)
    marked = replace(grid_map, evidence=evidence, surfaces=surfaces)
    classes = jnp.where(level > 0, Cell.BUMP, Cell.FLOOR).astype(jnp.int8)
    return add_votes(marked, count, jnp.broadcast_to(classes, spec.shape), jnp.broadcast_to(level, spec.shape))


def ground_height(grid_map: GridMap, ij: Int[Array, "2"], z: Float[Array, ""], spec: GridSpec) -> Float[Array, ""]:
    """Height [m] of the ground of a cell, as it was measured, at the level that `z` [m] is nearest to.

    It is `z` itself where nothing was measured there, and the height of the level where it is as good as that.
    """
    level = jnp.clip(jnp.round(z / spec.level_height), 0, spec.ground_levels - 1).astype(jnp.int32)
    weight, rise = (leaf[level, ij[0], ij[1]] for leaf in (grid_map.surfaces.weight, grid_map.surfaces.rise))
    off = rise / jnp.maximum(weight, 1e-6)
    off = jnp.where(jnp.abs(off) > AS_GOOD, off, 0.0)
    return jnp.where(weight > 0, level * spec.level_height + off, z)
