"""Durations of moves over (cell, heading): those of the primitives, and of the measurements between them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int8

from jaxbiped.core.batching import unfold
from jaxbiped.core.checks import reals
from jaxbiped.errors import InputError
from jaxbiped.planning.arguments import grid_arguments
from jaxbiped.planning.costs import (
    BASE_PITCH,
    DIRECTIONS,
    FORBIDDEN,
    IN_GATE,
    STEP,
    UNMEASURED,
    Rules,
    cell_kinds,
    move_kind,
)
from jaxbiped.planning.heading.edge_direction import beside, crossing_faces

LEAST = 0.05  # [s] shortest duration of a move: a path must come nearer to its goal with each cell
REACH = math.sqrt(2.0)  # [cells of 5 cm] longest forward displacement of a step over an edge


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Times:
    """Durations of the motions [s] (paper, Table 2, and a measurement); scalars, or one per arena. All traced."""

    straight: Float[Array, "*B"] | float = 16.0  # 5 cm forward
    turn: Float[Array, "*B"] | float = 5.0  # 45 degrees
    step_up: Float[Array, "*B"] | float = 96.0  # one level
    step_down: Float[Array, "*B"] | float = 96.0
    pass_gate: Float[Array, "*B"] | float = 48.0  # 5 cm forward, squatting; including getting down and up
    measure: Float[Array, "*B"] | float = 10.0  # after each primitive
    unmeasured: Float[Array, "*B"] | float = 800.0  # expected cost of 5 cm into unmeasured cells: C4 at 8 s per unit


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Moves:
    """Moves out of each cell in each of `DIRECTIONS`."""

    time: Float[Array, "*B 8 H W"]  # [s] without the turn to `face`; inf: forbidden
    face: Int8[Array, "*B 8 H W"]  # the direction that the robot faces from then on: the move's own, except at edges


def heading_moves(
    classes: Any, levels: Any, times: Times, rules: Rules, pitch: float = BASE_PITCH, extra: Any = None
) -> Moves:
    """The moves of Eq. 1, with the seconds that the mission's clock counts for them (`motion.duration`).

    A move is a decision: the duration of its primitive, and a measurement. On pitches below 5 cm several moves in line
    are one primitive, and share its measurement. Precedence is that of Eq. 1 (`costs.move_kind`): an end unmeasured,
    then a step, then an end in a gate. Over an edge the robot faces perpendicular to it (`crossing_faces`), and stays
    so; a step carries it forward, and the lateral part of the move is walked. Before unmeasured cells it looks once
    more. Leading axes broadcast.

    Deviations from the clock: yaws are multiples of 45 degrees and positions are cells; a primitive that crosses an
    edge on a fine pitch carries the robot over several cells, here over one.

    Args:
      classes, levels: as for `planning.field`.
      times, rules: leaves [*B]; none of the times negative or NaN.
      pitch: static [m].
      extra: [*B, 8, H, W], seconds to add to each move, not below 0.

    Raises:
      InputError: an argument of another rank, shape or dtype, or a value out of range where values are concrete.
    """
    pitch = checked_pitch(pitch)
    arrays = {} if extra is None else {"extra": (reals("extra", extra, "8 H W"), "8 H W")}
    batch, inputs = grid_arguments(classes, levels, times, rules, arrays=arrays)
    classes, levels, times, rules, *more = jax.tree.map(jnp.asarray, inputs)
    return unfold(moves_of(classes, levels, times, rules, pitch, *more), batch)


def checked_pitch(pitch: Any) -> float:
    """A pitch [m], which is static: a positive number.

    Raises:
      InputError: anything else.
    """
    if isinstance(pitch, bool) or not isinstance(pitch, (int, float, np.number)) or not 0 < pitch < math.inf:
        shown = pitch if isinstance(pitch, (int, float, str)) else type(pitch).__name__
        raise InputError("must be a number of metres above 0", field="pitch", value=shown)
    return float(pitch)


def moves_of(
    classes: Int8[Array, "B H W"],
    levels: Int8[Array, "B H W"],
    times: Times,
    rules: Rules,
    pitch: float,
    extra: Float[Array, "B 8 H W"] | None = None,
) -> Moves:
    """`heading_moves` for checked arguments, all [B]."""

    t, allowed = jax.tree.map(lambda leaf: leaf[:, None, None], (times, rules))
    kinds = cell_kinds(classes, allowed)
    share = t.measure / max(1, round(BASE_PITCH / pitch))
    faces = crossing_faces(classes, levels, pitch)
    time, face = [], []
    for k in range(8):
        di, dj = (int(d) for d in DIRECTIONS[k])
        there, ground = beside(kinds, di, dj, FORBIDDEN), beside(levels, di, dj, 0)
        sides = (beside(kinds, di, 0, FORBIDDEN), beside(kinds, 0, dj, FORBIDDEN)) if di and dj else None
        kind = move_kind((kinds, levels), (there, ground), sides, allowed.corner_cutting)
        cells = math.hypot(di, dj) * pitch / BASE_PITCH
        askew = faces[:, k] != k
        ahead, aside = (jnp.where(askew, cells * math.sqrt(0.5), value) for value in (cells, 0.0))
        rise = ground.astype(jnp.int16) - levels.astype(jnp.int16)
        step = jnp.where(rise > 0, t.step_up, t.step_down)
        seconds = t.straight * cells + share
        seconds = jnp.where(kind == IN_GATE, t.pass_gate * cells + share, seconds)
        beyond = (jnp.maximum(ahead - REACH, 0.0) + aside) * t.straight
        seconds = jnp.where(kind == STEP, step + beyond + t.measure, seconds)
        feared = t.straight * cells + share + t.measure + t.unmeasured * (pitch / BASE_PITCH)
        seconds = jnp.maximum(jnp.where(kind == UNMEASURED, feared, seconds), LEAST)
        time.append(jnp.where(kind == FORBIDDEN, jnp.inf, seconds))
        face.append(jnp.where(kind == STEP, faces[:, k], jnp.int8(k)))
    time = jnp.stack(time, axis=1)
    return Moves(time if extra is None else time + extra, jnp.stack(face, axis=1))
