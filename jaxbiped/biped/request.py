"""The request for a primitive."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

from jaxbiped.errors import InputError
from jaxbiped.motion.config import DurationConfig
from jaxbiped.motion.grid_units import CELL, EIGHTH

LONGEST, WIDEST, SHARPEST = 0.0708, 0.04, math.radians(22.6)  # [m, m, rad] limits of one pair of steps
PAIRS = 6  # most pairs of steps in one primitive


@dataclass(frozen=True)
class Request:
    """One primitive: a displacement of the home posture, the stance in which it is walked, and its duration.

    The five primitives of Table 2 are `straight`, `turn`, `step` (up and down) and `gate`; `squat`, `stand` and any
    mixture of forward, left and turn are requests too.
    """

    name: str
    forward: float = 0.0  # [m]
    left: float = 0.0  # [m]
    turn: float = 0.0  # [rad] anticlockwise
    rise: float = 0.0  # [m] rise of the ground beyond an edge
    squat_start: bool = False
    squat: bool = False  # while walking
    squat_end: bool = False
    duration: float = 16.0  # [s]
    lean: float = 0.0  # [m] of the load on the upper ground: from the foot's middle, away from the edge

    def __post_init__(self):
        for field in ("forward", "left", "turn", "rise", "duration", "lean"):
            if not math.isfinite(getattr(self, field)):
                raise InputError("must be a finite number", field=field, value=getattr(self, field))
        if not self.duration > 0.0:
            raise InputError("must be positive", field="duration", value=self.duration)
        if self.pairs > PAIRS:
            raise InputError(
                f"needs {self.pairs} pairs of steps; at most {PAIRS}: {LONGEST * PAIRS:.2f} m ahead, "
                f"{WIDEST * PAIRS:.2f} m sideways, {math.degrees(SHARPEST * PAIRS):.0f} degrees",
                field=self.name,
            )
        if self.rise and self.pairs != 1:
            raise InputError("a rise is climbed in one pair of steps", field="forward", value=self.forward)

    @property
    def pairs(self) -> int:
        """Pairs of steps; none if the feet stay. A rise is climbed in one, whatever its length."""
        if self.rise:
            return 1
        parts = abs(self.forward) / LONGEST, abs(self.left) / WIDEST, abs(self.turn) / SHARPEST
        return math.ceil(max(parts) - 1e-6)

    def lasting(self, duration: float) -> Request:
        """The same request with another duration [s]."""
        return dataclasses.replace(self, duration=duration)


TABLE_2 = DurationConfig()


def straight(length: float, squat: bool = False) -> Request:
    """Straight-forward, in Table 2's time; with `squat`, from squat to squat."""
    return Request("straight", length, squat_start=squat, squat=squat, squat_end=squat,
                   duration=TABLE_2.straight * max(abs(length), CELL / 5) / CELL)  # fmt: skip


def turn(angle: float, squat: bool = False) -> Request:
    """Turn-direction [rad], in Table 2's time."""
    return Request("turn", turn=angle, squat_start=squat, squat=squat, squat_end=squat,
                   duration=TABLE_2.turn * max(abs(angle), EIGHTH / 2) / EIGHTH)  # fmt: skip


def step(length: float, rise: float, lean: float = 0.0) -> Request:
    """Step-up-bump (`rise` > 0) or step-down-bump, in Table 2's time."""
    up = rise > 0
    return Request("step up" if up else "step down", length, rise=rise, lean=lean,
                   duration=TABLE_2.step_up if up else TABLE_2.step_down)  # fmt: skip


def gate(length: float) -> Request:
    """Pass-gate: squat, walk, stand up, in Table 2's time."""
    return Request("gate", length, squat=True, duration=TABLE_2.pass_gate * max(abs(length), CELL) / CELL)


def squat(duration: float = 8.0) -> Request:
    """Squat down."""
    return Request("squat", squat=True, squat_end=True, duration=duration)


def stand(duration: float = 8.0) -> Request:
    """Stand up."""
    return Request("stand", squat_start=True, squat=True, duration=duration)


def sidestep(left: float, squat: bool = False, duration: float = 8.0) -> Request:
    """Step sideways."""
    return Request("sidestep", left=left, squat_start=squat, squat=squat, squat_end=squat, duration=duration)
