"""The primitives by name, as they are verified: the five of Table 2, and the others that missions play."""

from __future__ import annotations

import dataclasses
import math
from typing import Literal

from jaxbiped.biped import request as ask
from jaxbiped.biped.request import Request

Pace = Literal["paper", "fast"]

PAPER: dict[str, Request] = {
    "straight": ask.straight(0.05),
    "turn": ask.turn(math.pi / 4),
    "step_up": ask.step(0.10, 0.03),
    "step_down": ask.step(0.10, -0.03),
    "gate": ask.gate(0.15),
    "squat": ask.squat(),
    "squat_straight": ask.straight(0.05, squat=True),
    "stand": ask.stand(),
    "sidestep": ask.sidestep(0.03),
}
"""At Table 2's durations. A step over the edge of a bump is 10 cm long, because a foot of 10 cm moved by 5 cm would
stand on the edge; a gate takes three cells, because the head needs room to come down and up."""
FIVE = ("straight", "turn", "step_up", "step_down", "gate")
FAST = {  # [s] as fast as servos and balance safely allow
    "straight": 2.5,
    "turn": 4.5,
    "step_up": 8.0,
    "step_down": 8.0,
    "gate": 8.0,
    "squat": 1.5,
    "squat_straight": 2.5,
    "stand": 1.5,
    "sidestep": 2.5,
}


def catalogue(pace: Pace = "paper", bump: float = 0.03) -> dict[str, Request]:
    """Every primitive by name, at the paper's durations or fast, for a bump of a given height [m]."""
    asked = {name: request if pace == "paper" else request.lasting(FAST[name]) for name, request in PAPER.items()}
    return {
        name: dataclasses.replace(request, rise=math.copysign(bump, request.rise)) if request.rise else request
        for name, request in asked.items()
    }
