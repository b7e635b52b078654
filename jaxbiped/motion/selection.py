"""From the planned path to the next command (paper, 2.4): local planning."""

from __future__ import annotations

import math

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.geometry.pose import wrap_angle
from jaxbiped.mapping.grid import Cell, GridSpec
from jaxbiped.motion.edge import crossing_direction
from jaxbiped.motion.grid_units import CELL
from jaxbiped.motion.local_map import LocalMap
from jaxbiped.motion.primitives import Command, Primitive
from jaxbiped.planning import DIRECTIONS

TURN_DEADBAND = 0.04  # [rad] smaller turns are not worth playing: 2 mm at the end of a cell
SHORTEST = 0.02  # [m] shortest forward primitive


def stride(spec: GridSpec) -> int:
    """Number of cells that one primitive of 5 cm covers; 1 on the paper's pitch and on coarser ones."""
    return max(1, round(CELL / spec.pitch))


def cell_of(x: Float[Array, "*S"], y: Float[Array, "*S"], spec: GridSpec) -> Int[Array, "2 *S"]:
    """The cell (i, j) that contains each point [m]; points outside give the nearest cell."""
    height, width = spec.shape
    i = jnp.clip(jnp.floor(y / spec.pitch), 0, height - 1)
    j = jnp.clip(jnp.floor(x / spec.pitch), 0, width - 1)
    return jnp.stack([i, j]).astype(jnp.int32)


def select(local: LocalMap, directions: Int[Array, "n"], looked: Bool[Array, ""]) -> Command:
    """The command that takes the robot along the first moves of its path.

    The robot turns to the next cell's centre and walks there, which also corrects its offset from its own cell's
    centre. An edge of a bump is crossed perpendicularly. A gate is passed squatting. Before an unmeasured cell, the
    robot turns to it and looks down, once: the additional measurement that C4 stands for (paper, 2.3). If `stride` is
    above 1, cells in one line and of one kind are walked as one primitive.

    Args:
      local: on the level of whose cell the robot stands.
      directions: first moves of the path, indices into DIRECTIONS; -1 after its end. The first must be a move.
      looked: the robot has already looked down from here.
    """
    classes, levels, ij, pose, spec = local.classes, local.levels, local.ij, local.pose, local.grid
    moves = jnp.asarray(DIRECTIONS)
    step_ij = moves[directions[0]]
    reach = jnp.arange(1, directions.shape[0] + 1)
    cells = ij[None] + reach[:, None] * step_ij[None]
    i = jnp.clip(cells[:, 0], 0, spec.shape[0] - 1)
    j = jnp.clip(cells[:, 1], 0, spec.shape[1] - 1)
    kinds, heights = classes[i, j].astype(jnp.int32), levels[i, j].astype(jnp.int32)
    level = levels[ij[0], ij[1]].astype(jnp.int32)
    kind, rise = kinds[0], jnp.clip(heights[0] - level, -1, 1)

    same = (directions == directions[0]) & (kinds == kind) & (heights == heights[0])
    count = jnp.sum(jnp.cumprod(same.astype(jnp.int32)))
    ahead = math.pi / 4 * jnp.round(jnp.arctan2(1.0 * step_ij[0], 1.0 * step_ij[1]) / (math.pi / 4))
    target_x = (ij[1] + count * step_ij[1] + 0.5) * spec.pitch
    target_y = (ij[0] + count * step_ij[0] + 0.5) * spec.pitch
    dx, dy = target_x - pose.x, target_y - pose.y
    distance = jnp.hypot(dx, dy)
    towards = jnp.where(distance > SHORTEST, jnp.arctan2(dy, dx), ahead)

    # Over an edge: perpendicular to it, and as far beyond it as the next cell's centre.
    square = crossing_direction(classes, levels, ij, step_ij, rise, spec.pitch)
    depth = dx * jnp.cos(square) + dy * jnp.sin(square)

    unmeasured = kind == Cell.UNMEASURED
    over_edge = (rise != 0) & ~unmeasured
    gate = (kind == Cell.GATE) | (classes[ij[0], ij[1]] == Cell.GATE)
    look = unmeasured & ~looked
    direction = jnp.where(over_edge, square, towards)
    length = jnp.clip(jnp.where(over_edge, depth, distance), SHORTEST, 1.6 * math.sqrt(2.0) * max(spec.pitch, CELL))
    primitive = jnp.where(gate, Primitive.PASS_GATE, Primitive.STRAIGHT_FORWARD)
    primitive = jnp.where(over_edge & (rise > 0), Primitive.STEP_UP_BUMP, primitive)
    primitive = jnp.where(over_edge & (rise < 0), Primitive.STEP_DOWN_BUMP, primitive)
    primitive = jnp.where(look, Primitive.LOOK, primitive)
    turn = wrap_angle(direction - pose.yaw)
    return Command(
        turn=jnp.where(jnp.abs(turn) < TURN_DEADBAND, 0.0, turn),
        primitive=primitive.astype(jnp.int32),
        length=jnp.where(look, 0.0, length),
        rise=jnp.where(over_edge & ~look, rise, 0).astype(jnp.int32),
        squat=gate & ~look,
        left=jnp.zeros_like(length),
    )
