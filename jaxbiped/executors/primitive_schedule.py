"""From a decision to what the biped plays: requests in order, and their tables of servo targets.

A mission's clock counts Table 2's durations, as with every executor. The simulation may be faster: at the pace
`fast` a straight step takes 2.5 s instead of 16 s and one over an edge 8 s instead of 96 s, which servos and balance
safely allow; at the pace `paper` the movements also have Table 2's durations.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float64

from jaxbiped.biped import request as ask
from jaxbiped.biped.config import RobotModelConfig
from jaxbiped.biped.gait import generate
from jaxbiped.biped.request import Request
from jaxbiped.motion.primitives import Primitive

Pace = Literal["fast", "paper"]

REST, PAIR = 0.5, 2.0  # [s] at the pace `fast`: of a movement, and of each pair of steps in it
CLIMB, CROUCH = 8.0, 1.5  # [s] of a step up or down; of getting down or up
PER_METRE = 1000  # displacements are rounded to a millimetre; the next plan corrects the remainder
ANGLE = math.radians(0.5)  # [rad] resolution of turns
WIDEST_TURN = math.pi / 2  # [rad] in one movement
FURTHEST_CLIMB = 0.10  # [m] that a step up or down can reach
TABLES = 4096  # tables kept in memory


@dataclass(frozen=True)
class Move:
    """One decision for one robot, as plain numbers; see `motion.primitives.Command`."""

    turn: float  # [rad]
    primitive: Primitive
    length: float  # [m]
    rise: int  # levels
    squat: bool
    left: float = 0.0  # [m]


def requests(move: Move, squatting: bool, rise: float, pace: Pace = "fast") -> tuple[Request, ...]:
    """The requests that a robot plays for a decision; empty if it only looks.

    It gets up, if it squats and must not; turns; gets down, if it must squat; steps sideways; and plays the
    primitive. Pass-gate is split: down once in front of the gate, straight steps in a squat, up at the first decision
    without a gate. Displacements are rounded to a millimetre and to `ANGLE`; a step up or down reaches at most
    `FURTHEST_CLIMB`.

    Args:
      squatting: its stance before.
      rise: [m] height of one level.
    """
    parts = []
    if squatting and not move.squat:
        parts.append(ask.stand())
    low = squatting and move.squat
    turn = ANGLE * round(move.turn / ANGLE)
    if pieces := math.ceil(abs(turn) / WIDEST_TURN - 1e-6):
        parts += [ask.turn(turn / pieces, squat=low)] * pieces
    if move.squat and not squatting:
        parts.append(ask.squat())
    left, length = (round(value * PER_METRE) / PER_METRE for value in (move.left, move.length))
    if left:
        parts.append(ask.sidestep(left, squat=move.squat))
    if move.primitive in (Primitive.STEP_UP_BUMP, Primitive.STEP_DOWN_BUMP):
        climb = ask.step(min(length, FURTHEST_CLIMB), move.rise * rise)
        low = {"squat_start": True, "squat": True, "squat_end": True} if move.squat else {}
        parts.append(dataclasses.replace(climb, **low))
    elif move.primitive in (Primitive.STRAIGHT_FORWARD, Primitive.PASS_GATE) and length:
        parts.append(ask.straight(length, squat=move.squat))
    return tuple(parts) if pace == "paper" else tuple(fast(part) for part in parts)


def fast(request: Request) -> Request:
    """The same at the pace `fast`."""
    if request.rise:
        return request.lasting(CLIMB)
    return request.lasting(REST + PAIR * request.pairs if request.pairs else CROUCH)


@functools.lru_cache(maxsize=TABLES)
def targets(request: Request, robot: RobotModelConfig) -> Float64[np.ndarray, "T 12"]:
    """Servo targets [rad] of a request, one row per step; each is generated once."""
    return generate(request, robot).ctrl
