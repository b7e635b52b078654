"""Moving obstacles: boxes that move back and forth between two positions, at constant speed.

The arenas of the paper are static; moving obstacles are its future work. The position of a mover is a function of the
mission's time alone, so that all strategies meet the same ones. Movers do not see the robot, and do not stop for it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxbiped.core.checks import finite
from jaxbiped.core.signatures import checked
from jaxbiped.geometry.boxes import Boxes

if TYPE_CHECKING:
    from jaxbiped.arenas.arena import Arena

ARENA = {"Arena": "jaxbiped.arenas.arena"}  # which imports this module
SHORTEST = 1e-3  # [m] a shorter path counts as none


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Movers:
    """The paths of the `M` boxes of an arena. With speed 0 the box stands still, at its phase."""

    dx: Float[Array, "*B M"]  # [m] from the position of the box to the far end of its path
    dy: Float[Array, "*B M"]  # [m]
    speed: Float[Array, "*B M"]  # [m/s]
    phase: Float[Array, "*B M"]  # at time 0: 0 at its position, 1 at the far end, up to 2 on the way back


@checked(numbers=("time",), late=ARENA)
def at_time(arena: Arena, time: Float[Array, ""] | float) -> Arena:
    """One arena as it is at a time [s] of its mission, with static boxes."""
    finite("time", time)
    if arena.movers is None:
        return arena
    return replace(arena, boxes=boxes_at(arena, time), movers=None)


def boxes_at(arena: Arena, time: Float[Array, ""] | float) -> Boxes:
    """The boxes of one arena at a time [s]."""
    movers, boxes = arena.movers, arena.boxes
    way = jnp.hypot(movers.dx, movers.dy)
    gone = movers.phase + jnp.where(way > SHORTEST, movers.speed * time / jnp.maximum(way, SHORTEST), 0.0)
    part = 1.0 - jnp.abs(jnp.mod(gone, 2.0) - 1.0)
    return replace(boxes, x=boxes.x + part * movers.dx, y=boxes.y + part * movers.dy)


@checked(late=ARENA)
def only(arena: Arena, moving: bool) -> Arena:
    """One arena with only its moving boxes, or only its static ones, which are at their positions."""
    if arena.movers is None:
        return arena
    moves = (arena.movers.speed > 0) & (jnp.hypot(arena.movers.dx, arena.movers.dy) > SHORTEST)
    if moving:
        return replace(arena, boxes=replace(arena.boxes, used=arena.boxes.used & moves))
    still = at_time(arena, 0.0)
    return replace(still, boxes=replace(still.boxes, used=still.boxes.used & ~moves))
