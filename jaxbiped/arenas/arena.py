"""The world in which a robot is placed."""

from __future__ import annotations

from dataclasses import dataclass

import jax
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.arenas.moving_boxes import Movers
from jaxbiped.geometry.boxes import Boxes
from jaxbiped.geometry.height_field import HeightField

CIRCLE, SQUARE = 0, 1  # kinds of landmark
DISC_RADIUS, SQUARE_SIDE = 0.075, 0.05  # [m] (paper, 3.1)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Landmarks:
    """`L` landmark slots, flat on the floor, at positions known to the robot (paper, 2, condition 2)."""

    x: Float[Array, "*B L"]  # [m]
    y: Float[Array, "*B L"]  # [m]
    yaw: Float[Array, "*B L"]  # [rad]; meaningless for a circle
    kind: Int[Array, "*B L"]  # CIRCLE or SQUARE
    used: Bool[Array, "*B L"]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Arena:
    """One arena: boxes, terrain, landmarks, start and goal.

    The floor is the rectangle [0, size_x] x [0, size_y] at z = 0, except where terrain replaces it.
    """

    size_xy: Float[Array, "*B 2"]  # [m]
    boxes: Boxes
    landmarks: Landmarks
    start_xyyaw: Float[Array, "*B 3"]  # [m, m, rad]
    goal_xy: Float[Array, "*B 2"]  # [m]
    floor_contrast: Float[Array, "*B"]  # texture contrast of the floor, 0 to 1
    family: Int[Array, "*B"]  # index into `families.KNOWN`; -1 for a scene written by hand
    difficulty: Float[Array, "*B"]  # 0 (easy) to 1 (hard)
    movers: Movers | None = None  # None: all boxes stand still
    terrain: HeightField | None = None  # None: flat floor. In a hole there is no ground
