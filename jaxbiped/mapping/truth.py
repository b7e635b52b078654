"""The class grid of perfect knowledge: for oracle plans and for scoring maps."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, UInt32

from jaxbiped.arenas.arena import Arena
from jaxbiped.arenas.ground import HOLE, ground_height, terrain_height
from jaxbiped.core.signatures import checked
from jaxbiped.geometry.boxes import Boxes, covers
from jaxbiped.geometry.height_field import HeightField, surface_height
from jaxbiped.mapping.cobstacles import classify_cells
from jaxbiped.mapping.grid import Body, Cell, GridSpec, check_body
from jaxbiped.mapping.relief import Relief

SAMPLES = 5  # a cell is sampled at 5 x 5 places
LEAST_SHARE = 0.05  # a level is occupied in a cell when something stands there in over this share of its places
MOST_HOLES = 0.5  # share of its places that are holes, from which on a cell is one


@checked(numbers=("body",))
def truth_grid(arena: Arena, spec: GridSpec, body: Body) -> tuple[Int[Array, "H W"], Int[Array, "H W"]]:
    """Classes (int8) and ground levels (int8) of one arena, known perfectly, by the rule of `c_obstacles`.

    Each cell is sampled at 5 x 5 places. A level is occupied where over 5 % of them hold a box at that level; the
    ground is the level of most places (a tie goes to the higher one), and level 0 where most are too high to stand on.
    A box fills the levels from that of its bottom (the floor, for one that stands) to that of its top, and terrain
    those up to its surface. Heights are exact: the mean of the places at the ground's level, and, of what is near, the
    highest at an occupied level. Ground below the base floor counts as level 0 at a height that is off it: what lies
    deeper than the robot bears is an obstacle, and so is a hole of the terrain. No cell is unmeasured. A box of which
    a number is NaN stands nowhere.

    Raises:
      InputError: an argument of another rank, shape or type, or a body that `grid.check_body` refuses.
    """
    check_body(body, spec)
    (height, width), n = spec.shape, SAMPLES
    y = (jnp.arange(height * n) + 0.5) * (spec.pitch / n)
    x = (jnp.arange(width * n) + 0.5) * (spec.pitch / n)
    x, y = jnp.broadcast_arrays(x, y[:, None])
    solid = filled_levels(arena.boxes, x, y, spec)
    heights = ground_height(arena, x, y)
    if arena.terrain is not None:
        solid = solid | levels_up_to(terrain_height(arena.terrain, x, y), spec)
        heights = jnp.where(heights == HOLE, jnp.nan, heights)
    columns, ground, relief, holes = read_places(heights, solid, spec)
    classes, levels = classify_cells(columns, ground, relief, body, 0.0, spec)
    return jnp.where(holes, jnp.int8(Cell.OBSTACLE), classes), levels


@checked(numbers=("body",))
def terrain_grid(terrain: HeightField, spec: GridSpec, body: Body) -> tuple[Int[Array, "H W"], Int[Array, "H W"]]:
    """Classes (int8) and ground levels (int8) of one height field, by the rule of `truth_grid`.

    Holes, and what lies off the field, are unmeasured. Works its way row by row, so that a map of millions of cells
    needs memory for one row of places.

    Args:
      terrain: heights [m] above the base floor; cell (0, 0) has its outer corner at (0, 0) [m].

    Raises:
      InputError: an argument of another rank, shape or type, or a body that `grid.check_body` refuses.
    """
    check_body(body, spec)
    (height, width), n = spec.shape, SAMPLES
    x = ((jnp.arange(width * n) + 0.5) * (spec.pitch / n))[None]

    def read_row(row: Int[Array, ""]):
        y = ((row * n + jnp.arange(n) + 0.5) * (spec.pitch / n))[:, None]
        heights = surface_height(terrain, *jnp.broadcast_arrays(x, y))
        return read_places(heights, levels_up_to(heights, spec), spec)

    columns, ground, relief, holes = jax.tree.map(
        lambda leaf: leaf[:, 0], jax.lax.map(read_row, jnp.arange(height), batch_size=8)
    )
    classes, levels = classify_cells(columns, ground, relief, body, 0.0, spec)
    return jnp.where(holes, jnp.int8(Cell.UNMEASURED), classes), jnp.where(holes, jnp.int8(0), levels)


def read_places(
    heights: Float[Array, "Y X"], solid: UInt32[Array, "Y X"], spec: GridSpec
) -> tuple[UInt32[Array, "..."], Int[Array, "..."], Relief, Bool[Array, "..."]]:
    """Cells [Y / 5, X / 5] of places: masks of occupied levels, ground levels, their relief, and which are holes.

    Args:
      heights: [m] of the ground; NaN in a hole.
      solid: masks of the levels that are solid.
    """
    n = SAMPLES
    height, width = heights.shape[0] // n, heights.shape[1] // n

    def share(places):
        """Share of each cell's places."""
        return places.reshape(height, n, width, n, *places.shape[2:]).mean((1, 3), dtype=jnp.float32)

    bits = jnp.arange(spec.levels + spec.lowest, dtype=jnp.uint32)
    occupied = share((solid[..., None] >> bits) & 1) > LEAST_SHARE
    columns = jnp.sum(jnp.where(occupied, jnp.uint32(1) << bits, 0), axis=-1, dtype=jnp.uint32)
    hole = jnp.isnan(heights)
    # what is higher than any level may lie beyond the range of integers
    level = jnp.round(jnp.clip(heights / spec.level_height, 0, 1000)).astype(jnp.int32)
    level = jnp.where(hole, -1, level)
    at_level = level[..., None] == jnp.arange(spec.ground_levels)
    walkable = share(at_level)
    best = spec.ground_levels - 1 - jnp.argmax(walkable[..., ::-1], axis=-1)
    ground = jnp.where(walkable.sum(-1) >= 0.5, best, 0)
    relief = exact_relief(jnp.where(at_level, heights[..., None], -jnp.inf), walkable, ground, spec)
    return columns, ground, relief, share(hole) >= MOST_HOLES


def exact_relief(
    heights: Float[Array, "Y X G"], shares: Float[Array, "I J G"], ground: Int[Array, "I J"], spec: GridSpec
) -> Relief:
    """The relief of known ground: heights [m] of all places at each level (else -inf), and their shares of a cell."""
    (height, width), n = ground.shape, SAMPLES
    cells = heights.reshape(height, n, width, n, spec.ground_levels)
    total = jnp.where(cells > -jnp.inf, cells, 0.0).sum((1, 3))
    mean = total / jnp.maximum(shares * n**2, 1.0)
    own = jnp.take_along_axis(mean, ground[..., None], axis=-1)[..., 0]
    known = jnp.take_along_axis(shares, ground[..., None], axis=-1)[..., 0] > 0
    top = jnp.where(shares > LEAST_SHARE, cells.max((1, 3)), -jnp.inf).max(-1)
    return Relief(jnp.where(known, own, ground * spec.level_height), jnp.zeros(ground.shape), top)


def filled_levels(boxes: Boxes, x: Float[Array, "Y X"], y: Float[Array, "Y X"], spec: GridSpec) -> UInt32[Array, "Y X"]:
    """Mask of the levels that are solid at each place; the base floor, level 0, always is."""
    top_level = spec.levels + spec.lowest - 1
    solid = jnp.ones(x.shape, jnp.uint32)
    for m in range(boxes.x.shape[-1]):
        first = jnp.where(boxes.overhead[m], jnp.round(boxes.bottom[m] / spec.level_height), 0)
        last = jnp.minimum(jnp.round(boxes.top[m] / spec.level_height), top_level)
        levels = jnp.arange(32)
        fills = (levels >= first) & (levels <= last)
        mask = jnp.sum(jnp.where(fills, jnp.uint32(1) << jnp.arange(32, dtype=jnp.uint32), 0), dtype=jnp.uint32)
        solid = solid | jnp.where(covers(boxes, m, x, y), mask, 0)
    return solid


def levels_up_to(heights: Float[Array, "Y X"], spec: GridSpec) -> UInt32[Array, "Y X"]:
    """Mask of the levels that ground of such heights [m] fills; the base floor, level 0, always is."""
    top = spec.levels + spec.lowest - 1
    last = jnp.round(jnp.clip(jnp.nan_to_num(heights / spec.level_height, nan=0.0), 0, top)).astype(jnp.uint32)
    return jnp.uint32(0xFFFFFFFF) >> (jnp.uint32(31) - last)
