"""Reading ways off a field over (cell, heading), and timing the ways that Eq. 1 chooses."""

from __future__ import annotations

import math
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float, Int

from jaxbiped.planning.costs import DIRECTIONS
from jaxbiped.planning.heading.field import HeadingField
from jaxbiped.planning.heading.times import Moves
from jaxbiped.planning.path import Path, pick

EIGHTH = math.pi / 4


def eighths(angle: Float[Array, "*S"]) -> Float[Array, "*S"]:
    """How many turns of 45 degrees an angle [rad] is, whichever way round it is shorter: 0 to 4."""
    return jnp.abs(jnp.mod(angle + math.pi, 2 * math.pi) - math.pi) / EIGHTH


@partial(jax.jit, static_argnames="max_length")
def heading_path(
    field: HeadingField, start_ij: Int[Array | np.ndarray, "B 2"], yaw: Float[Array | np.ndarray, "B"], max_length: int
) -> Path:
    """The quickest way from each start. `Path.cost` is its time [s], with the turn from `yaw` to the first move.

    Of ways that are equally quick (`planning.path.TIE`) it keeps to the robot's present direction, else takes the first
    in the order of `DIRECTIONS`. It ends at the goal.

    Args:
      start_ij: outside the grid there is no way.
      yaw: [rad] any, not only multiples of 45 degrees.
      max_length: static; number of moves that there is room for.
    """
    height, width = field.cost.shape[-2:]
    arena, moves = jnp.arange(field.cost.shape[0]), jnp.asarray(DIRECTIONS, jnp.int32)
    start = jnp.asarray(start_ij, jnp.int32)
    inside = ((start >= 0) & (start < jnp.array([height, width]))).all(-1)

    def ahead(ij, yaw):
        """Of each direction: the whole time, the time to go after the move, and what the robot then faces."""
        at = (arena, slice(None), ij[:, 0], ij[:, 1])
        time, face = field.moves.time[at], field.moves.face[at].astype(jnp.int32)
        near = ij[:, None] + moves
        within = ((near >= 0) & (near < jnp.array([height, width]))).all(-1)
        near = jnp.where(within[..., None], near, 0)
        left = jnp.where(within, field.cost[arena[:, None], face, near[..., 0], near[..., 1]], jnp.inf)
        return field.turn[:, None] * eighths(face * EIGHTH - yaw[:, None]) + time + left, left, face

    def at_goal(ij):
        return field.cost[arena, 0, ij[:, 0], ij[:, 1]] == 0

    def step(state, _):
        ij, yaw = state
        total, left, face = ahead(ij, yaw)
        heading = jnp.round(yaw / EIGHTH).astype(jnp.int32) % 8
        going = inside & ~at_goal(ij)
        direction = pick(total, (left < total.min(-1, keepdims=True)) & going[:, None], heading)
        goes = direction >= 0
        ij = jnp.where(goes[:, None], ij + moves[direction], ij)
        yaw = jnp.where(goes, jnp.take_along_axis(face, direction[:, None], 1)[:, 0] * EIGHTH, yaw)
        return (ij, yaw), (jnp.where(goes[:, None], ij, -1), direction)

    first = jnp.where(inside[:, None], start, 0), jnp.asarray(yaw, jnp.float32)
    (last, _), (cells, directions) = lax.scan(step, first, None, length=max_length)
    total = jnp.where(at_goal(first[0]), 0.0, ahead(*first)[0].min(-1))
    total = jnp.where(inside, total, jnp.inf)
    cells = jnp.moveaxis(jnp.concatenate([start[None], cells]), 0, 1)
    return Path(cells, directions.T, (directions >= 0).sum(0), total, inside & at_goal(last))


@jax.jit
def path_time(
    moves: Moves, turn: Float[Array, "B"], path: Path, yaw: Float[Array | np.ndarray, "B"]
) -> Float[Array, "B"]:
    """What any way takes [s], that of Eq. 1 for one: turns from `yaw` on, and moves; inf where it is not valid."""
    arena = jnp.arange(turn.shape[0])

    def step(state, moved):
        total, yaw = state
        ij, direction = moved
        goes, k = direction >= 0, jnp.maximum(direction, 0).astype(jnp.int32)
        i, j = jnp.maximum(ij[:, 0], 0), jnp.maximum(ij[:, 1], 0)
        face = moves.face[arena, k, i, j] * EIGHTH
        spent = turn * eighths(face - yaw) + moves.time[arena, k, i, j]
        return (total + jnp.where(goes, spent, 0.0), jnp.where(goes, face, yaw)), None

    first = jnp.zeros(turn.shape), jnp.asarray(yaw, jnp.float32)
    ways = jnp.moveaxis(path.cells_ij[:, :-1], 1, 0), path.directions.T
    total = lax.scan(step, first, ways)[0][0]
    return jnp.where(path.valid, total, jnp.inf)
