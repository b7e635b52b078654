"""The class grid of perfect knowledge: for oracle plans and for scoring maps."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float, Int, UInt32

from jaxbiped.arenas.arena import Arena
from jaxbiped.core.signatures import checked
from jaxbiped.geometry.boxes import Boxes, covers, ground_height
from jaxbiped.mapping.cobstacles import read_cells
from jaxbiped.mapping.grid import Body, GridSpec, check_body

SAMPLES = 5  # a cell is sampled at 5 x 5 places
LEAST_SHARE = 0.05  # a level is occupied in a cell when something stands there in over this share of its places


@checked(numbers=("body",))
def truth_grid(arena: Arena, spec: GridSpec, body: Body) -> tuple[Int[Array, "H W"], Int[Array, "H W"]]:
    """Classes (int8) and ground levels (int8) of one arena, known perfectly, by the rule of `c_obstacles`.

    Each cell is sampled at 5 x 5 places. A level is occupied where over 5 % of them hold a box at that level; the
    ground is the level of most places (a tie goes to the higher one), and level 0 where most are too high to stand on.
    A box fills the levels from that of its bottom (the floor, for one that stands) to that of its top. No cell is
    unmeasured. A box of which a number is NaN stands nowhere.

    Raises:
      InputError: an argument of another rank, shape or type, or a body that `grid.check_body` refuses.
    """
    check_body(body, spec)
    (height, width), n = spec.shape, SAMPLES
    y = (jnp.arange(height * n) + 0.5) * (spec.pitch / n)
    x = (jnp.arange(width * n) + 0.5) * (spec.pitch / n)
    x, y = jnp.broadcast_arrays(x, y[:, None])

    def share(places):
        """Share of each cell's places."""
        return places.reshape(height, n, width, n, *places.shape[2:]).mean((1, 3), dtype=jnp.float32)

    levels = spec.levels + spec.lowest
    solid = filled_levels(arena.boxes, x, y, spec)
    bits = jnp.arange(levels, dtype=jnp.uint32)
    occupied = share((solid[..., None] >> bits) & 1) > LEAST_SHARE
    columns = jnp.sum(jnp.where(occupied, jnp.uint32(1) << bits, 0), axis=-1, dtype=jnp.uint32)
    ground = jnp.round(ground_height(arena.boxes, x, y) / spec.level_height).astype(jnp.int32)
    walkable = share(ground[..., None] == jnp.arange(spec.ground_levels))
    best = spec.ground_levels - 1 - jnp.argmax(walkable[..., ::-1], axis=-1)
    ground = jnp.where(walkable.sum(-1) >= 0.5, best, 0)
    return read_cells(columns, ground, body, 0.0, spec)


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
