"""The pre-computed motion primitives (paper, 2.4 and Table 2) and how long they take."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.motion.grid_units import CELL, EIGHTH


class Primitive(enum.IntEnum):
    """What the robot plays after it has turned to its direction."""

    NONE = 0
    STRAIGHT_FORWARD = 1
    STEP_UP_BUMP = 2
    STEP_DOWN_BUMP = 3
    PASS_GATE = 4
    LOOK = 5  # stay, and tilt the camera down for one more measurement


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Command:
    """One decision of the robot: a turn on the spot, a step to the side, then one primitive."""

    turn: Float[Array, "*B"]  # [rad] anticlockwise
    primitive: Int[Array, "*B"]  # Primitive
    length: Float[Array, "*B"]  # [m] forward, after the turn; negative: backward
    rise: Int[Array, "*B"]  # levels climbed: -1, 0 or 1
    squat: Bool[Array, "*B"]  # stance in which the primitive is played
    left: Float[Array, "*B"] | float = 0.0  # [m] to the side, after the turn and before the primitive


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Durations:
    """`DurationConfig`, traced."""

    straight: Float[Array, "*B"]
    turn: Float[Array, "*B"]
    step_up: Float[Array, "*B"]
    step_down: Float[Array, "*B"]
    pass_gate: Float[Array, "*B"]
    measure: Float[Array, "*B"]


def duration(command: Command, durations: Durations) -> Float[Array, "*B"]:
    """Time [s] that a command takes (Table 2): turns by angle, straight and gate by length, steps by event.

    A step over a bump carries the robot up to one diagonal cell forward; any further distance is walked straight. Steps
    sideways and backward, which are not in Table 2, take as long as forward ones.
    """
    cells = jnp.abs(command.length) / CELL
    beyond = jnp.maximum(cells - math.sqrt(2.0), 0.0) * durations.straight
    spent = jnp.stack(
        [
            jnp.zeros_like(cells),
            cells * durations.straight,
            durations.step_up + beyond,
            durations.step_down + beyond,
            cells * durations.pass_gate,
            jnp.zeros_like(cells),
        ]
    )
    played = jnp.take_along_axis(spent, command.primitive[None].astype(jnp.int32), axis=0)[0]
    aside = jnp.abs(command.left) / CELL * durations.straight
    return jnp.abs(command.turn) / EIGHTH * durations.turn + aside + played
