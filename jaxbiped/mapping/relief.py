"""Relief: how high the ground is within its level, as it was measured, and what can be stood on.

A level is 3 cm, and a step that is off by 1 cm is a fall. So the map keeps, for each level that may be ground, the mean
height of the surface there. A level is a name that rounding gives; these heights decide.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, UInt32

from jaxbiped.mapping.grid import Body, GridSpec, patch_sum
from jaxbiped.mapping.params import MapParams
from jaxbiped.sensing.view import View

SURE = 2.0  # standard errors that a height must be off, to be off
EDGE = 0.010  # [m] two surfaces of one cell lie further apart; nearer, they are one, between two levels
FACE = 0.004  # [m] below the mean of a raised level: what is lower is no top, but the face below it
SHARE = 0.1  # of the points of a surface next to it, below which a surface is none, but a matcher's mixture at its edge


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Surfaces:
    """The points, so far, of the surfaces at each ground level; `G` levels, from 0, each a plane of its own."""

    weight: Float[Array, "*B G H W"]  # [px] how much they tell: pixels near by, a part of them from further off
    rise: Float[Array, "*B G H W"]  # [px m] the sum of their heights above that of their level, so weighted


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Relief:
    """The ground of each cell as heights [m]."""

    height: Float[Array, "*B H W"]  # of the cell's own ground
    error: Float[Array, "*B H W"]  # the standard error of that; 0 where it is exact, or nothing is known
    top: Float[Array, "*B H W"]  # at least so high is solid ground in the cell; -inf: there is none


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class PlacedView:
    """A view brought level, and the voxels that its points lie in."""

    view: View  # in the robot frame
    z: Float[Array, "*B"]  # [m] height of what the robot stands on
    index: Int[Array, "*B N"]  # the voxel of each point, as of a flat grid
    counts: Bool[Array, "*B N"]  # whether it counts


def no_surfaces(spec: GridSpec) -> Surfaces:
    """Of one arena before the first view."""
    return Surfaces(*(jnp.zeros((spec.ground_levels, *spec.shape)) for _ in range(2)))


def add_surfaces(surfaces: Surfaces, placed: PlacedView, params: MapParams, spec: GridSpec) -> Surfaces:
    """The surfaces of one arena after what one more view tells of them.

    The error of a height grows in proportion to the distance (`params.height_range`), and a point weighs accordingly.
    Of a raised level only the upper points count, down to `FACE` below the mean so far: seen from far off, a cell at an
    edge shows more of the face than of the top.
    """
    view, z, index, counts = placed.view, placed.z, placed.index, placed.counts
    level = jnp.maximum(index % spec.levels + spec.lowest, 0)
    counts = counts & (level < spec.ground_levels)
    cell = jnp.where(counts, level * (spec.shape[0] * spec.shape[1]) + index // spec.levels, 0)
    least = jnp.where(surfaces.weight > 0, surfaces.rise / jnp.maximum(surfaces.weight, 1e-6) - FACE, -jnp.inf)
    # A product here would be rounded by some compilers and not by others.
    rise = view.z + z - jnp.take(spec.ground_heights(), level, mode="clip")
    counts = counts & ((level == 0) | (rise >= least.reshape(-1)[cell]))
    weight = jnp.where(counts, surface_share(view, params), 0.0)
    rise = jnp.where(counts, weight * rise, 0.0)

    def add(old, new):
        return old.reshape(-1).at[cell].add(new, mode="promise_in_bounds").reshape(old.shape)

    return Surfaces(add(surfaces.weight, weight), add(surfaces.rise, rise))


def surface_share(view: View, params: MapParams) -> Float[Array, "N"]:
    """How much each point tells of the surface that it lies on [px]."""
    return view.weight / (1 + (view.x**2 + view.y**2) / params.height_range**2)


def read_relief(
    surfaces: Surfaces,
    ground: Int[Array, "H W"],
    columns: UInt32[Array, "H W"],
    solid: UInt32[Array, "H W"],
    params: MapParams,
    spec: GridSpec,
) -> Relief:
    """The relief of one arena: of each cell's own ground, at level `ground`, and of its highest solid ground.

    The mean of a surface is that of the patch of about 5 x 5 cm around a cell (at least the cell), and is told to
    `SURE` standard errors of as many pixels (`params.height_sd`). Where the ground may be a phantom, and in a cell that
    holds an edge, whose face blurs it, it is at the height of its level.

    A matcher mixes what lies before an edge with what lies behind it, so a few points hang in the air past the edge,
    up to 1 cm above it. Hence what is high is so in two neighbouring cells; and since such points lie along the whole
    of an edge, a cell's surface counts as a top only where it has `SHARE` of the points that a cell within 5 cm has
    there.

    Args:
      columns: masks of the occupied levels; `solid`: of those that are not phantoms.
    """
    many, rise = jnp.maximum(patch_sum(surfaces.weight, spec), 1e-6), patch_sum(surfaces.rise, spec)
    levels = range(spec.ground_levels)
    mean = [level * jnp.float32(spec.level_height) + rise[level] / many[level] for level in levels]
    # The root of a quotient, since XLA makes a product of a quotient by a root, and one operation of that and of a sum.
    error = [jnp.sqrt(jnp.square(SURE * params.height_sd) / many[level]) for level in levels]
    most = greatest_within(surfaces.weight, spec.beside)
    height = jnp.take(spec.ground_heights(), ground, mode="clip")
    sd, top = jnp.zeros(ground.shape), jnp.full(ground.shape, -jnp.inf)
    for level in levels:
        known = (solid >> level) & 1 != 0
        if level + 1 < spec.ground_levels:
            above = (columns >> (level + 1)) & 1 != 0
            known &= ~(above & (mean[level + 1] - mean[level] > EDGE))
        here = known & (ground == level)
        height, sd = jnp.where(here, mean[level], height), jnp.where(here, error[level], sd)
        whole = surfaces.weight[level] >= SHARE * most[level]
        top = jnp.where(known & whole, mean[level] - error[level], top)
    return Relief(height, sd, jnp.minimum(top, neighbours(top, greater, -jnp.inf)))


def is_untenable(relief: Relief, ground: Int[Array, "H W"], body: Body, spec: GridSpec) -> Bool[Array, "H W"]:
    """Whether a step into a cell ends off the height that its level promises, by more than `body.height_tolerance`.

    It does where the ground lies off its level by more than that; and, since what counts is the height between two
    cells, where it lies off to one side and a neighbour's to the other. Of two neighbours that do not go together the
    one that is further off is untenable. What may be an error of measurement is none.
    """
    off = relief.height - jnp.take(spec.ground_heights(), ground, mode="clip")
    high, low = off - relief.error, off + relief.error  # surely at least, surely at most
    highest, lowest = neighbours(high, greater, -jnp.inf), -neighbours(-low, greater, -jnp.inf)
    most, half = body.height_tolerance, body.height_tolerance / 2
    alone = (high > most) | (low < -most)
    clash = ((high > half) & (high - lowest > most)) | ((low < -half) & (highest - low > most))
    return alone | clash


def greater(a: Array, b: Array) -> Array:
    """The greater of two arrays without NaN; `jnp.maximum` carries NaN along, and is several times slower for it."""
    return jnp.where(a > b, a, b)


def greatest_within(planes: Float[Array, "_ _ _"], reach: int, axes: tuple[int, int] = (1, 2)) -> Float[Array, "_ _ _"]:
    """In each plane the greatest of each cell and those up to `reach` cells from it, along both of its `axes`."""
    margins = [(reach, reach) if axis in axes else (0, 0) for axis in range(3)]
    planes = jnp.pad(planes, margins, constant_values=-jnp.inf)
    for axis in axes:
        width = 1
        while width < 2 * reach + 1:  # each entry is the greatest of `width` from it on
            step = min(width, 2 * reach + 1 - width)
            left = planes.shape[axis] - step
            planes = greater(*(jax.lax.slice_in_dim(planes, first, first + left, axis=axis) for first in (0, step)))
            width += step
    return planes


def neighbours(values: Float[Array, "H W"], combine, nothing: float) -> Float[Array, "H W"]:
    """The greatest, or the least, of the eight cells around each; `nothing` beyond the rim."""
    width = values.shape[1]
    padded = jnp.pad(values, 1, constant_values=nothing)
    beside = combine(padded[:-2], padded[2:])
    column = combine(beside, padded[1:-1])
    return combine(combine(column[:, :width], column[:, 2 : width + 2]), beside[:, 1 : width + 1])
