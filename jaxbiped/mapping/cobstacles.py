"""C-obstacles: 3D evidence to the class of each cell (paper, 2.2, Figs. 4 and 5).

One arena, no batch axis. A column of the 3D grid is one 32-bit mask of its occupied levels (bit l = level l), so that
growing the obstacles by the robot's radius is an OR of shifted masks, and reading a cell a test against bands of bits.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, UInt32

from jaxbiped.core import checks
from jaxbiped.core.batching import by_batch_size, by_platform
from jaxbiped.core.signatures import checked
from jaxbiped.mapping.grid import Body, Cell, GridSpec, check_body, patch_sum
from jaxbiped.mapping.params import MapParams
from jaxbiped.mapping.relief import SURE, Relief, Surfaces, greater, greatest_within, is_untenable, read_relief

MANY = 8  # maps at once from which machine code of our own is worth the seconds that it takes to compile


@checked(numbers=("evidence", "surfaces", "body", "params"))
def c_obstacles(
    evidence: Float[Array, "H W Z"], surfaces: Surfaces, body: Body, params: MapParams, spec: GridSpec
) -> tuple[Int[Array, "H W"], Int[Array, "H W"]]:
    """Classes (int8, `Cell`) and ground levels (int8) of all cells of one arena, from its evidence [pixels].

    A column's ground is its supporting surface (`ground_level`), read off the occupied voxels (`occupied_levels`); what
    stands in the way are the solid ones (`solid_levels`). Heights of ground are those measured (`mapping.relief`). A
    cell is then, in this order,
    - obstacle, when something solid within the body's radius stands more than one step above this cell's own ground
      and below the squatting head; or when its own ground is off its level by more than a step bears (`is_untenable`);
    - gate, when so below the standing head;
    - bump, when its ground is above level 0;
    - floor.
    No cell is unmeasured here: one without points is read as base floor, within the reach of its neighbours. That is
    `classify`'s to say. Beyond the rim of the grid nothing is occupied. Under `jit`, where values are not known, NaN
    compares false, and a radius beyond `spec.max_radius` is cut to that.

    Raises:
      InputError: an argument of another rank, shape or type, evidence that is not finite, a body that
        `grid.check_body` refuses, NaN in `params`.
    """
    check_body(body, spec)
    checks.finite("evidence", evidence)
    for name in ("weight", "rise"):
        checks.finite(f"surfaces.{name}", getattr(surfaces, name))
    return class_cells(evidence, surfaces, careful(body, params), params, spec)


@partial(jax.custom_jvp, nondiff_argnums=(4,))
def class_cells(
    evidence: Float[Array, "H W Z"], surfaces: Surfaces, body: Body, params: MapParams, spec: GridSpec
) -> tuple[Int[Array, "H W"], Int[Array, "H W"]]:
    """`c_obstacles` of arguments that are known to be good: as `gridmap.add_view`, by a kernel or by XLA."""
    by_kernel, by_xla = (partial(way, spec=spec) for way in (class_by_kernel, class_by_xla))
    read = by_batch_size(by_xla, by_platform(by_kernel, by_xla), MANY)
    return read(evidence, surfaces, body, params)


@class_cells.defjvp
def class_cells_jvp(spec, primals, tangents):
    """Integers do not change with what they are read from."""
    out = class_cells(*primals, spec)
    return out, tuple(np.zeros(leaf.shape, jax.dtypes.float0) for leaf in out)


def class_by_xla(evidence, surfaces, body, params, spec):
    """`class_cells` in JAX."""
    columns = occupied_levels(evidence, params, spec)
    ground = ground_level(columns, evidence, spec)
    solid = solid_levels(columns, evidence, params, spec)
    relief = read_relief(surfaces, ground, columns, solid, params, spec)
    return classify_cells(solid, ground, relief, body, params.head_margin, spec)


def class_by_kernel(evidence, surfaces, body, params, spec):
    """`class_cells` by machine code: a view without points is added to the map."""
    from jaxbiped.mapping.kernels import map_update  # with Numba, which takes a second to import

    votes, level_votes = (jnp.zeros((*spec.shape, kinds)) for kinds in (4, spec.ground_levels))
    points = tuple(jnp.zeros(0, kind) for kind in map_update.POINT_KINDS)
    maps = evidence, votes, level_votes, surfaces
    *_, classes, levels = map_update.add_view(maps, points, *kernel_settings(body, params, spec), spec)
    return classes, levels


def kernel_settings(
    body: Body, params: MapParams, spec: GridSpec
) -> tuple[Float[Array, "K"], Int[Array, "R"], UInt32[Array, "2"]]:
    """The numbers, the rows of the disc and the levels in the way that `kernels.map_update` reads a map by."""
    numbers = (
        params.voxel_points * spec.cell_share, params.voxel_share, params.solid_points,
        jnp.inf if params.below_points is None else params.below_points,
        jnp.square(SURE * params.height_sd), body.step, body.step_tolerance, body.height_tolerance,
        body.height_tolerance / 2, params.view_points * spec.cell_share,
    )  # fmt: skip
    bands = jnp.stack(obstructing_levels(body, params.head_margin, spec))
    reaches = jnp.sum(disc(body.radius, spec), 1, dtype=jnp.int32) - 1
    return jnp.stack([jnp.asarray(n, jnp.float32) for n in numbers]), reaches, bands


def careful(body: Body, params: MapParams) -> Body:
    """The same robot, with what heights are measured to (`params.height_margin`) taken off what it bears."""
    step, height = body.step_tolerance - params.height_margin, body.height_tolerance - params.height_margin
    return replace(body, step_tolerance=step, height_tolerance=height)


def occupied_levels(evidence: Float[Array, "H W Z"], params: MapParams, spec: GridSpec) -> UInt32[Array, "H W"]:
    """Masks of the occupied levels of each column; a voxel below level 0 counts as the base floor, level 0.

    A voxel is occupied when it holds `params.voxel_points`, and a share of `params.voxel_share` of the voxels right
    above and below it, out of which noise may leak.
    """
    above = jnp.pad(evidence[..., 1:], ((0, 0), (0, 0), (0, 1)))
    below = jnp.pad(evidence[..., :-1], ((0, 0), (0, 0), (1, 0)))
    least = jnp.maximum(params.voxel_points * spec.cell_share, params.voxel_share * greater(below, above))
    return pack((evidence > 0) & (evidence >= least), spec)


def solid_levels(
    columns: UInt32[Array, "H W"], evidence: Float[Array, "H W Z"], params: MapParams, spec: GridSpec
) -> UInt32[Array, "H W"]:
    """The occupied levels (of `columns`) that are not phantoms.

    A stereo matcher's phantoms are single clumps of few pixels. So a solid voxel has `params.solid_points` within the
    patch of about 5 x 5 cm around it (at least its own cell) and another such voxel among its 26 neighbours. And at an
    edge a matcher mixes what lies before it with what lies behind, view by view: a solid voxel has a share of
    `params.voxel_share` of the points of each patch within 5 cm, one level higher or lower. Below a solid voxel, down
    to the first gap, `params.below_points` are enough, where that is not None.
    """
    height, width = columns.shape
    points = jnp.moveaxis(patch_sum(jnp.moveaxis(evidence, -1, 0), spec), 0, -1)
    padded = jnp.pad(points, ((0, 0), (0, 0), (1, 1)))
    leaking = greatest_within(greater(padded[..., :-2], padded[..., 2:]), spec.beside, axes=(0, 1))
    dense = columns & pack((points >= params.solid_points) & (points >= params.voxel_share * leaking), spec)
    if params.below_points is not None:
        dense = downwards(dense, columns & pack(points >= params.below_points, spec))
    others = dense << 1 | dense >> 1
    around = jnp.pad(dense | others, 1)
    for i, j in itertools.product(range(3), range(3)):
        if (i, j) != (1, 1):
            others = others | around[i : i + height, j : j + width]
    return dense & others


def downwards(solid: UInt32[Array, "H W"], through: UInt32[Array, "H W"]) -> UInt32[Array, "H W"]:
    """`solid`, and the levels of `through` that hang without a gap below one of them."""
    for reach in (1, 2, 4, 8, 16):
        solid, through = solid | through & (solid >> reach), through & (through >> reach)
    return solid


def pack(voxels: Bool[Array, "H W Z"], spec: GridSpec) -> UInt32[Array, "H W"]:
    """Columns of voxels as masks of levels; what lies below level 0 is level 0."""
    bits = jnp.uint32(1) << jnp.maximum(jnp.arange(spec.levels) + spec.lowest, 0).astype(jnp.uint32)
    return jax.lax.reduce(jnp.where(voxels, bits, 0), jnp.uint32(0), jax.lax.bitwise_or, (2,))


def ground_level(columns: UInt32[Array, "H W"], evidence: Float[Array, "H W Z"], spec: GridSpec) -> Int[Array, "H W"]:
    """Level [int32] of each column's supporting surface: in its lowest run of occupied levels, the one with most.

    A run that ends above the levels that a robot may stand on is a wall, and a column without points is unknown: both
    stand on the base floor, level 0. (The top of the run would be a bump in each cell that a bump's edge only grazes.)
    """
    lowest = columns & (~columns + 1)
    run = columns & ~(columns + lowest)
    best, most = jnp.zeros(columns.shape, jnp.int32), jnp.zeros(columns.shape)
    for level in range(spec.ground_levels):
        here = jnp.where((run >> level) & 1 != 0, evidence[..., level - spec.lowest], 0.0)
        best, most = jnp.where(here > most, level, best), jnp.maximum(here, most)
    return jnp.where(run >> spec.ground_levels == 0, best, 0)


def classify_cells(
    solid: UInt32[Array, "H W"],
    ground: Int[Array, "H W"],
    relief: Relief,
    body: Body,
    head_margin: Float[Array, ""] | float,
    spec: GridSpec,
) -> tuple[Int[Array, "H W"], Int[Array, "H W"]]:
    """Classes (int8) and levels (int8) from masks of solid levels, and from level and relief of each cell's ground.

    Ground near by that is higher than a step is told by its height; whether anything else is in the way, by its level.
    """
    near = dilate(solid, body.radius, spec)
    highest = dilate(relief.top, body.radius, spec, greater, -jnp.inf)
    blocked = highest > relief.height + relief.error + body.step + body.step_tolerance
    blocked |= is_untenable(relief, ground, body, spec)
    bands = obstructing_levels(body, head_margin, spec)
    squatting, standing = (near & (band << ground.astype(jnp.uint32)) for band in bands)
    classes = jnp.where(ground > 0, Cell.BUMP, Cell.FLOOR)
    classes = jnp.where(standing != 0, Cell.GATE, classes)
    classes = jnp.where((squatting != 0) | blocked, Cell.OBSTACLE, classes)
    return classes.astype(jnp.int8), ground.astype(jnp.int8)


def obstructing_levels(
    body: Body, head_margin: Float[Array, ""] | float, spec: GridSpec
) -> tuple[UInt32[Array, ""], UInt32[Array, ""]]:
    """Masks of the levels, counted from the ground, that a squatting body meets, and a standing one."""
    lower_face = (jnp.arange(32) - 0.5) * spec.level_height
    above_step = lower_face >= body.step
    heads = lower_face + head_margin < body.squatting, lower_face < body.standing
    bits = jnp.uint32(1) << jnp.arange(32, dtype=jnp.uint32)
    return tuple(jnp.sum(jnp.where(above_step & below, bits, 0), dtype=jnp.uint32) for below in heads)


def disc(radius: Float[Array, ""], spec: GridSpec) -> Bool[Array, "R R"]:
    """Which offsets of whole rows and columns bring a cell's square nearer than `radius` [m]; (0, 0) always does.

    By symmetry this quarter of them is all. `radius` is traced, so it holds those up to `spec.max_radius`.
    """
    reach = max(math.ceil(spec.max_radius / spec.pitch + 0.5) - 1, 0)
    gap = jnp.maximum(jnp.arange(reach + 1) - 0.5, 0.0) * spec.pitch
    return (gap[:, None] ** 2 + gap[None, :] ** 2 < radius**2).at[0, 0].set(True)


def dilate(columns: Array, radius: Float[Array, ""], spec: GridSpec, combine=jnp.bitwise_or, nothing=0) -> Array:
    """OR of the columns [H, W] whose square comes nearer than `radius` [m] to a cell's centre, its own always included.

    All offsets of `disc` are visited; a radius beyond `spec.max_radius` is cut to that.

    Args:
      combine: what gathers them in place of OR; `nothing` is what changes nothing there.
    """
    within = disc(radius, spec)
    reach = len(within) - 1
    # Grow each row by every half width that some row distance needs, then gather the rows above and below.
    height, width = columns.shape
    nothing = jnp.asarray(nothing, columns.dtype)
    padded = jnp.pad(columns, ((0, 0), (reach, reach)), constant_values=nothing)
    aside = [
        combine(padded[:, reach + k : reach + k + width], padded[:, reach - k : reach - k + width])
        for k in range(reach + 1)
    ]
    grown = jnp.full_like(columns, nothing)
    for rows in range(reach + 1):
        line = jnp.full_like(columns, nothing)
        for k in range(reach + 1):
            line = combine(line, jnp.where(within[rows, k], aside[k], nothing))
        line = jnp.pad(line, ((reach, reach), (0, 0)), constant_values=nothing)
        grown = combine(grown, line[reach + rows : reach + rows + height])
        grown = combine(grown, line[reach - rows : reach - rows + height])
    return grown
