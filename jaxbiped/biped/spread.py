"""Sets of disturbances for the verification of primitives, each drawn from a seed."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
import pydantic

from jaxbiped.biped.config import JOINTS, SIDES
from jaxbiped.biped.trial import Disturbance
from jaxbiped.config import Model

Spread = Annotated[float, pydantic.Field(ge=0.0)]
Factor = Annotated[float, pydantic.Field(gt=0.0)]


class DisturbanceSet(Model):
    """Range of each disturbance: uniform from the first number to the second, or to both sides of zero."""

    friction: tuple[Factor, Factor] = (0.8, 0.8)
    """Friction between feet and ground."""
    mass: tuple[Factor, Factor] = (1.0, 1.0)
    """Factor on all masses."""
    rise: Spread = 0.0
    """[m] Error of the bump's height."""
    edge: Spread = 0.0
    """[m] Error of the distance of the bump's edge."""
    yaw: Spread = 0.0
    """[deg] Rotation of the edge, or of the gate."""
    lateral: Spread = 0.0
    """[m] Lateral offset of the gate."""
    slope: Spread = 0.0
    """[deg] Slope of the ground ahead."""
    servo: Spread = 0.0
    """[deg] Standard deviation of the zero offset of each servo; normal."""

    def draw(self, rng: np.random.Generator) -> Disturbance:
        """One disturbance; consumes 7 uniform and 12 normal numbers, whatever the ranges, so that sets are paired."""
        unit = rng.uniform(-1.0, 1.0, 7)
        between = lambda limits, u: limits[0] + (limits[1] - limits[0]) * (u + 1) / 2  # noqa: E731
        offsets = math.radians(self.servo) * rng.standard_normal(len(SIDES) * len(JOINTS))
        return Disturbance(
            friction=between(self.friction, unit[0]),
            mass=between(self.mass, unit[1]),
            rise=self.rise * unit[2],
            edge=self.edge * unit[3],
            yaw=math.radians(self.yaw) * unit[4],
            lateral=self.lateral * unit[5],
            slope=math.radians(self.slope) * unit[6],
            servo=tuple(offsets.tolist()),
        )

    def draws(self, count: int, seed: int) -> list[Disturbance]:
        """`count` disturbances; the first ones of a larger count are the same."""
        rng = np.random.default_rng(seed)
        return [self.draw(rng) for _ in range(count)]


MILD = DisturbanceSet(friction=(0.4, 1.2), mass=(0.8, 1.2), rise=0.003, yaw=3.0, lateral=0.005)
"""Disturbances that every primitive must tolerate."""
HARD = DisturbanceSet(
    friction=(0.2, 1.2), mass=(0.7, 1.3), rise=0.010, edge=0.020, yaw=12.0, lateral=0.010, slope=4.0, servo=1.5
)
"""Disturbances strong enough that every primitive that moves the feet fails sometimes."""
SETS = {"mild": MILD, "hard": HARD}
