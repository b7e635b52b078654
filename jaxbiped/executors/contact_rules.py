"""Effects of true boxes and terrain on a biped whose movements are drawn, not simulated: edges, falls and contacts."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxbiped.arenas.arena import Arena
from jaxbiped.arenas.ground import ground_height, rises_near
from jaxbiped.executors.execution import TOUCH
from jaxbiped.geometry.boxes import plan_distance
from jaxbiped.geometry.pose import Pose, to_world

NEAREST, FURTHEST, SPACING = -0.02, 0.20, 0.0025  # [m] ahead of the midpoint of the feet, where edges are searched
NONE = 1.0  # [m] if no edge is found
KICK = 0.01  # [m] height above the allowed step that a foot may touch
FOOT_TOP = 0.045  # [m] only feet are below this height
# The upper body of the simulated biped (biped.model), two horizontal capsules: half width and radius, and how far below
# the camera's top they begin and end [m].
HEAD, TORSO = (0.060, 0.015, 0.0, 0.030), (0.020, 0.040, 0.058, 0.138)
LATERAL = np.linspace(-1.0, 1.0, 9)  # lateral positions at which the body is checked


def edges(arena: Arena, pose: Pose, offset: Float[Array, ""], rise: Float[Array, ""]) -> tuple[Float[Array, "2"], ...]:
    """Distance [m] ahead of the robot to the first rise by a level, and to the first drop, on the paths of the two
    feet.

    Args:
      offset: [m] lateral offset of each foot.
      rise: [m] height of one level; half of it is the threshold.

    Returns:
      (rises, drops), each for the left and the right foot; `NONE` if there is none.
    """
    ahead = jnp.arange(NEAREST, FURTHEST, SPACING)
    side = jnp.stack([offset, -offset])[:, None]
    ground = ground_height(arena, *to_world(pose, ahead[None] + 0 * side, side + 0 * ahead[None])) - pose.z
    rises = (ground > rise / 2) & (ground < rise + KICK) & (ahead >= 0.0)
    first = lambda seen: jnp.min(jnp.where(seen, ahead - SPACING / 2, NONE), axis=1)  # noqa: E731
    return first(rises), first(ground < -rise / 2)


def off_ground(
    arena: Arena, pose: Pose, offset: Float[Array, ""], rims: Float[Array, "4"], tolerance: Float[Array, ""]
) -> Bool[Array, ""]:
    """Whether the ground under the feet is so much higher or lower than `pose.z` that the robot falls.

    Args:
      rims: `motion_library.Rims`: how near to the middle of a sole a rise, or a drop, may begin.
      tolerance: [m] tolerated difference in height.
    """
    up_ahead, up_aside, down_ahead, down_aside = rims
    zero = jnp.zeros(())
    out = jnp.zeros((), bool)
    for outward in (1.0, -1.0):
        ground = lambda x, y, s=outward: ground_height(arena, *to_world(pose, x, s * (offset + y))) - pose.z  # noqa: E731
        for x, y in ((up_ahead, zero), (-up_ahead, zero), (zero, up_aside)):
            out = out | (ground(x, y) > tolerance)
        for x, y in ((down_ahead, zero), (-down_ahead, zero), (zero, down_aside)):
            out = out | (ground(x, y) < -tolerance)
    return out


def body_touches(arena: Arena, pose: Pose, head: Float[Array, ""], sway: Float[Array, ""]) -> Bool[Array, ""]:
    """Whether head or torso hit a box or terrain while they sway by `sway` [m] to both sides.

    Args:
      head: [m] height of the camera's top above `pose.z`.
    """
    boxes, hit = arena.boxes, jnp.zeros((), bool)
    for half, radius, below_top, down_to in (HEAD, TORSO):
        aside = LATERAL * (half + sway)
        x, y = to_world(pose, 0 * aside, aside)
        low, high = pose.z + head - down_to, pose.z + head - below_top
        between = boxes.used & (boxes.bottom < high - TOUCH) & (boxes.top > low + TOUCH)
        hit = hit | jnp.any(between & (jax.vmap(plan_distance, (None, 0, 0))(boxes, x, y) < radius))
        if arena.terrain is not None:
            near = jax.vmap(rises_near, (None, 0, 0, None, None))(arena.terrain, x, y, jnp.float32(radius), low + TOUCH)
            hit = hit | jnp.any(near)
    return hit


def feet_touch(arena: Arena, pose: Pose, feet: Float[Array, "3"], highest: Float[Array, ""]) -> Bool[Array, ""]:
    """Whether a foot hits a box or terrain that is higher than `highest` [m], the most it may step on.

    Args:
      feet: [m] length and width of a sole, and its lateral offset.
    """
    boxes = arena.boxes
    length, width, offset = feet
    along = jnp.array([-1.0, 0.0, 1.0]) * (length - width) / 2
    ahead, aside = jnp.tile(along, 2), jnp.repeat(jnp.stack([offset, -offset]), 3)
    x, y = to_world(pose, ahead, aside)
    tall = boxes.used & (boxes.top > highest + KICK) & (boxes.bottom < pose.z + FOOT_TOP)
    hit = jnp.any(tall & (jax.vmap(plan_distance, (None, 0, 0))(boxes, x, y) < width / 2))
    if arena.terrain is None:
        return hit
    rises = jax.vmap(rises_near, (None, 0, 0, None, None))(arena.terrain, x, y, width / 2, highest + KICK)
    return hit | jnp.any(rises)
