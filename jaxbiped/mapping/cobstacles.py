"""C-obstacles: 3D evidence to the class of each cell (paper, 2.2, Figs. 4 and 5).

One arena, no batch axis. A column of the 3D grid is one 32-bit mask of its occupied levels (bit l = level l), so that
growing the obstacles by the robot's radius is an OR of shifted masks, and reading a cell a test against bands of bits.
"""

from __future__ import annotations

import itertools
import math

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, UInt32

from jaxbiped.core import checks
from jaxbiped.core.signatures import checked
from jaxbiped.mapping.grid import Body, Cell, GridSpec, check_body
from jaxbiped.mapping.params import MapParams


@checked(numbers=("evidence", "body", "params"))
def c_obstacles(
    evidence: Float[Array, "H W Z"], body: Body, params: MapParams, spec: GridSpec
) -> tuple[Int[Array, "H W"], Int[Array, "H W"]]:
    """Classes (int8, `Cell`) and ground levels (int8) of all cells of one arena, from its evidence [pixels].

    A column's ground is its supporting surface (`ground_level`), read off the occupied voxels (`occupied_levels`); what
    stands in the way are the solid ones (`solid_levels`). A cell is then,
    in this order,
    - obstacle, when something solid within the body's radius stands more than one step above this cell's own ground
      and below the squatting head;
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
    columns = occupied_levels(evidence, params, spec)
    ground = ground_level(columns, evidence, spec)
    return read_cells(solid_levels(columns, evidence, params, spec), ground, body, params.head_margin, spec)


def occupied_levels(evidence: Float[Array, "H W Z"], params: MapParams, spec: GridSpec) -> UInt32[Array, "H W"]:
    """Masks of the occupied levels of each column; a voxel below level 0 counts as the base floor, level 0.

    A voxel is occupied when it holds `params.voxel_points`, and a share of `params.voxel_share` of the voxels right
    above and below it, out of which noise may leak.
    """
    above = jnp.pad(evidence[..., 1:], ((0, 0), (0, 0), (0, 1)))
    below = jnp.pad(evidence[..., :-1], ((0, 0), (0, 0), (1, 0)))
    least = jnp.maximum(params.voxel_points * spec.cell_share, params.voxel_share * jnp.maximum(above, below))
    return pack((evidence > 0) & (evidence >= least), spec)


def solid_levels(
    columns: UInt32[Array, "H W"], evidence: Float[Array, "H W Z"], params: MapParams, spec: GridSpec
) -> UInt32[Array, "H W"]:
    """Those of the occupied levels (`columns`) that are no phantoms.

    A stereo matcher's phantoms are single clumps of few pixels. So a solid voxel has `params.solid_points` within the
    patch of about 5 x 5 cm around it (at least its own cell) and another such voxel among its 26 neighbours. Below such
    a voxel, down to the first gap, `params.below_points` are enough, where that is not None.
    """
    height, width = columns.shape
    aside = int(0.025 / spec.pitch + 1e-6)  # cells on each side that make up the patch
    if aside:
        padded = jnp.pad(evidence, ((aside, aside), (aside, aside), (0, 0)))
        rows = sum(padded[i : i + height] for i in range(2 * aside + 1))
        evidence = sum(rows[:, j : j + width] for j in range(2 * aside + 1))
    dense = columns & pack(evidence >= params.solid_points, spec)
    if params.below_points is not None:
        dense = downwards(dense, columns & pack(evidence >= params.below_points, spec))
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


def read_cells(
    solid: UInt32[Array, "H W"],
    ground: Int[Array, "H W"],
    body: Body,
    head_margin: Float[Array, ""] | float,
    spec: GridSpec,
) -> tuple[Int[Array, "H W"], Int[Array, "H W"]]:
    """Classes (int8) and levels (int8) from masks of solid levels and from the ground level of each cell."""
    near = dilate(solid, body.radius, spec)
    lower_face = (jnp.arange(32) - 0.5) * spec.level_height
    above_step = lower_face >= body.step
    squatting = near & band(above_step & (lower_face + head_margin < body.squatting), ground)
    standing = near & band(above_step & (lower_face < body.standing), ground)
    classes = jnp.where(ground > 0, Cell.BUMP, Cell.FLOOR)
    classes = jnp.where(standing != 0, Cell.GATE, classes)
    classes = jnp.where(squatting != 0, Cell.OBSTACLE, classes)
    return classes.astype(jnp.int8), ground.astype(jnp.int8)


def band(levels: Bool[Array, "32"], ground: Int[Array, "H W"]) -> UInt32[Array, "H W"]:
    """The mask of `levels` (Bool [32]), which are relative to the ground, in absolute levels for each cell."""
    bits = jnp.sum(jnp.where(levels, jnp.uint32(1) << jnp.arange(32, dtype=jnp.uint32), 0), dtype=jnp.uint32)
    return bits << ground.astype(jnp.uint32)


def dilate(columns: UInt32[Array, "H W"], radius: Float[Array, ""], spec: GridSpec) -> UInt32[Array, "H W"]:
    """OR of the columns whose square comes nearer than `radius` [m] to a cell's centre, its own always included.

    `radius` is traced, so all offsets up to `spec.max_radius` are visited; a larger radius is cut to that.
    """
    reach = max(math.ceil(spec.max_radius / spec.pitch + 0.5) - 1, 0)
    gap = jnp.maximum(jnp.arange(reach + 1) - 0.5, 0.0) * spec.pitch
    within = gap[:, None] ** 2 + gap[None, :] ** 2 < radius**2
    keep = jnp.where(within, jnp.uint32(0xFFFFFFFF), jnp.uint32(0)).at[0, 0].set(0xFFFFFFFF)
    # By symmetry one quarter of the offsets decides: grow each row by every half width that some row distance needs,
    # then OR the rows above and below.
    height, width = columns.shape
    padded = jnp.pad(columns, ((0, 0), (reach, reach)))
    aside = [
        padded[:, reach + k : reach + k + width] | padded[:, reach - k : reach - k + width] for k in range(reach + 1)
    ]
    grown = jnp.zeros_like(columns)
    for rows in range(reach + 1):
        line = jnp.zeros_like(columns)
        for k in range(reach + 1):
            line = line | (aside[k] & keep[rows, k])
        line = jnp.pad(line, ((reach, reach), (0, 0)))
        grown = grown | line[reach + rows : reach + rows + height] | line[reach - rows : reach - rows + height]
    return grown
