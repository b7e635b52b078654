"""The oracle: noise-free points of the whole true arena, seen and unseen. For tests, and as an upper bound."""

from __future__ import annotations

import math

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxbiped.arenas.arena import Arena
from jaxbiped.arenas.ground import HOLE, terrain_height
from jaxbiped.core.checks import finite, whole_number
from jaxbiped.core.signatures import checked
from jaxbiped.errors import InputError
from jaxbiped.geometry.boxes import Boxes, covers
from jaxbiped.geometry.pose import Pose, to_robot
from jaxbiped.sensing.view import View

LEAST = 1e-6  # [m] smallest value of positive parameters
MOST_POINTS = 100_000_000  # in a view: what fits in memory


@checked()
def measure(
    arena: Arena,
    pose: Pose,
    size_xy: tuple[float, float],
    spacing: float = 0.025,
    level_height: float = 0.03,
    levels: int = 15,
    weight: float = 16.0,
) -> View:
    """Points of one whole arena in the robot frame of the true `pose`; all arguments after it are static.

    On a lattice of `spacing` [m] over the area `size_xy` [m], each column has one point on the ground, and one in each
    other level that a box, or terrain, fills at least in part; holes have none. Columns are centres of squares, so that
    none lies on the edge of a cell of a pitch that `spacing` divides.

    Args:
      level_height: [m] between the points inside boxes; level l is about l times that.
      levels: 0 to levels - 1; boxes above (higher than any head) have no points there.
      weight: [px] weight of each point; the one on the ground, which supports, has twice that.

    Returns:
      `columns * (1 + levels)` points; weight 0 where a level is empty, and everywhere if the pose is not finite.

    Raises:
      InputError: an argument of another rank, shape or type; a size, spacing, height or number of levels that is not
        above 0, a weight below 0, or more than `MOST_POINTS` points.
    """
    for name, value in (("size_xy", size_xy), ("spacing", spacing), ("level_height", level_height)):
        finite(name, value, LEAST)
    finite("weight", weight, 0.0)
    points = math.prod(size / spacing for size in size_xy) * (1 + whole_number("levels", levels, 1))
    if not points <= MOST_POINTS:
        raise InputError(f"must give at most {MOST_POINTS:,} points", field="spacing", value=spacing)
    axes = ((np.arange(round(size / spacing), dtype=np.float32) + 0.5) * np.float32(spacing) for size in size_xy)
    x, y = (jnp.asarray(values.reshape(-1)) for values in np.meshgrid(*axes))
    ground, ceiling, cover = heights(arena.boxes, x, y)
    known = jnp.ones_like(ground[None], bool)
    if arena.terrain is not None:
        under = terrain_height(arena.terrain, x, y)
        stands, _, _ = heights(arena.boxes, x, y, floor=HOLE)
        ground = jnp.maximum(stands, under)
        known = ground[None] != HOLE
    level = (np.arange(levels, dtype=np.float32) * np.float32(level_height))[:, None]
    half = level_height / 2
    inside_floor = level < ground - half  # the ground itself has its own point, and is alone in its level
    inside_overhead = (level + half > ceiling) & (level - half <= cover)
    # A level that is partly filled by a box is measured where the box begins or ends.
    height = jnp.where(inside_floor, level, jnp.clip(level, ceiling, jnp.maximum(ceiling, cover)))
    z = jnp.concatenate([ground[None], height]) - pose.z
    there = jnp.concatenate([known, inside_floor | inside_overhead])
    forward, left = to_robot(pose, x, y)
    there = there & jnp.isfinite(forward + left + z)
    points = (jnp.where(there, axis, 0.0).reshape(-1) for axis in (forward[None], left[None], z))
    heavy = jnp.where(np.arange(levels + 1)[:, None] == 0, 2.0, 1.0)
    return View(*points, weight=jnp.where(there, weight * heavy, 0.0).reshape(-1))


def heights(
    boxes: Boxes, x: Float[Array, "N"], y: Float[Array, "N"], floor: float = 0.0
) -> tuple[Float[Array, "N"], Float[Array, "N"], Float[Array, "N"]]:
    """Height [m] of the ground (else `floor`), lowest bottom (else inf) and highest top (else -inf) of hanging boxes.

    Ground and ceiling are those of `geometry.boxes`; as a loop, since XLA would search the boxes again for each level.
    """

    def include(found, box):
        ground, ceiling, cover = found
        here, overhead = covers(box, 0, x, y), box.overhead[0]
        ground = jnp.where(here & ~overhead, jnp.maximum(ground, box.top[0]), ground)
        ceiling = jnp.where(here & overhead, jnp.minimum(ceiling, box.bottom[0]), ceiling)
        cover = jnp.where(here & overhead, jnp.maximum(cover, box.top[0]), cover)
        return (ground, ceiling, cover), None

    nothing = (jnp.full_like(x, floor), jnp.full_like(x, jnp.inf), jnp.full_like(x, -jnp.inf))
    return jax.lax.scan(include, nothing, jax.tree.map(lambda leaf: leaf[:, None], boxes))[0]  # slots of one
