"""Read paths from a field over (cell, heading), and time the paths that Eq. 1 chooses."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from jaxbiped.core.batching import fold, unfold
from jaxbiped.core.checks import cells, flags, integers, leading_shape, narrowed, reals, whole_number
from jaxbiped.planning.costs import DIRECTIONS
from jaxbiped.planning.heading.field import HeadingField
from jaxbiped.planning.heading.times import Moves
from jaxbiped.planning.path import Path, no_path, path_arguments, pick

EIGHTH = math.pi / 4


def eighths(angle: Float[Array, "*S"]) -> Float[Array, "*S"]:
    """Number of turns of 45 degrees in an angle [rad], in the shorter direction: 0 to 4."""
    return jnp.abs(jnp.mod(angle + math.pi, 2 * math.pi) - math.pi) / EIGHTH


def heading_path(field: HeadingField, start_ij: Any, yaw: Any, max_length: int) -> Path:
    """The fastest path from each start. `Path.cost` is its time [s], with the turn from `yaw` to the first move.

    Among equally fast paths (`planning.path.TIE`) it keeps the robot's present direction, else takes the first in the
    order of `DIRECTIONS`. It ends at the goal. Leading axes broadcast. May be called inside `jit`, `vmap` and `scan`.

    Args:
      field: where it did not converge there is no path.
      start_ij: [*B, 2], integers; outside the grid there is no path.
      yaw: [*B] [rad] any, not only multiples of 45 degrees.
      max_length: static; largest number of moves.

    Raises:
      InputError: an argument of another rank, shape or dtype.
    """
    start, yaw = cells("start_ij", start_ij), reals("yaw", yaw)
    length = whole_number("max_length", max_length)
    given = field_arguments(field.moves, field.turn)
    given["field.cost"] = reals("field.cost", field.cost, "8 H W"), "8 H W"
    given["field.converged"] = flags("field.converged", field.converged), ""
    batch = leading_shape(**given, start_ij=(start, "2"), yaw=(yaw, ""))
    time, face, turn, cost, converged = (fold(array, batch, len(core.split())) for array, core in given.values())
    start, yaw = fold(start, batch, 1), fold(yaw, batch, 0)
    if math.prod(cost.shape[2:]) == 0:
        return no_path(start, length, batch)
    field = HeadingField(cost, Moves(time, face), turn, converged)
    return unfold(_heading_path(jax.tree.map(jnp.asarray, field), start, yaw, length), batch)


def field_arguments(moves: Moves, turn: Any) -> dict[str, tuple[Any, str]]:
    """Moves and the time of a turn, checked, in the form for `leading_shape`."""
    return {
        "moves.time": (reals("moves.time", moves.time, "8 H W"), "8 H W"),
        "moves.face": (narrowed(integers("moves.face", moves.face, "8 H W", (0, 7)), np.int8, 0, 7), "8 H W"),
        "turn": (reals("turn", turn), ""),
    }


@partial(jax.jit, static_argnames="max_length")
def _heading_path(field: HeadingField, start, yaw, max_length: int) -> Path:
    field = replace(field, cost=jnp.where(field.converged[:, None, None, None], field.cost, jnp.inf))
    height, width = field.cost.shape[-2:]
    arena, moves = jnp.arange(field.cost.shape[0]), jnp.asarray(DIRECTIONS, jnp.int32)
    inside = ((start >= 0) & (start < jnp.array([height, width]))).all(-1)

    def ahead(ij, yaw):
        """For each direction: the total time, the time to go after the move, and the heading after it."""
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

    first = jnp.where(inside[:, None], start, 0), jnp.asarray(yaw)
    (last, _), (passed, directions) = lax.scan(step, first, None, length=max_length)
    total = jnp.where(at_goal(first[0]), 0.0, ahead(*first)[0].min(-1))
    total = jnp.where(inside, total, jnp.inf)
    passed = jnp.moveaxis(jnp.concatenate([start[None], passed]), 0, 1)
    length = (directions >= 0).sum(0, dtype=jnp.int32)
    return Path(passed, directions.T, length, total, inside & at_goal(last))


def path_time(moves: Moves, turn: Any, path: Path, yaw: Any) -> Float[Array, "*B"]:
    """Duration [s] of any path, such as that of Eq. 1: turns from `yaw` on, and moves; inf if it is not valid.

    Leading axes broadcast. May be called inside `jit`, `vmap`, `scan` and `grad`.

    Args:
      moves: from `heading_moves`; turn: [*B] [s] for 45 degrees.
      path: on the same grid; yaw: [*B] [rad].

    Raises:
      InputError: an argument of another rank, shape or dtype.
    """
    given = field_arguments(moves, turn) | path_arguments(path) | {"yaw": (reals("yaw", yaw), "")}
    batch = leading_shape(**given)
    inputs = (fold(array, batch, len(core.split())) for array, core in given.values())
    return unfold(_path_time(*map(jnp.asarray, inputs)), batch)


@jax.jit
def _path_time(time, face, turn, cells_ij, directions, valid, yaw) -> Float[Array, "B"]:
    arena = jnp.arange(turn.shape[0])

    def step(state, moved):
        total, yaw = state
        ij, direction = moved
        goes, k = direction >= 0, jnp.maximum(direction, 0).astype(jnp.int32)
        i, j = jnp.maximum(ij[:, 0], 0), jnp.maximum(ij[:, 1], 0)
        faced = face[arena, k, i, j] * EIGHTH
        spent = turn * eighths(faced - yaw) + time[arena, k, i, j]
        return (total + jnp.where(goes, spent, 0.0), jnp.where(goes, faced, yaw)), None

    first = jnp.zeros(turn.shape), yaw
    total = lax.scan(step, first, (jnp.moveaxis(cells_ij[:, :-1], 1, 0), directions.T))[0][0]
    return jnp.where(valid, total, jnp.inf)
