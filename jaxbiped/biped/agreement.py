"""Agreement of two backends on primitives: the robot's position at every moment, and the outcomes of hard trials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from jaxbiped import physics
from jaxbiped.biped.config import SIDES, RobotModelConfig
from jaxbiped.biped.gait import PrimitiveTable
from jaxbiped.biped.spread import DisturbanceSet
from jaxbiped.biped.trial import Disturbance, Tolerance, boxes_of
from jaxbiped.biped.verify import VARIED, address, roll, trial_spec, trials

CROSSING = DisturbanceSet(rise=0.014, edge=0.032, yaw=16.0)
"""Edges of a bump that are higher, lower, nearer, farther and rotated: about a third of the steps up fail."""


@dataclass(frozen=True)
class Paths:
    """The distance between two backends over time."""

    time: Float[np.ndarray, "T"]  # [s] since the start of the trial
    apart: Float[np.ndarray, "T"]  # [m] the largest over both soles and the head; NaN where one is not valid

    @property
    def worst(self) -> tuple[float, float]:
        """(distance [m], time [s]) of the maximum; infinite where one of them was not valid."""
        k = int(np.argmax(np.where(np.isnan(self.apart), np.inf, self.apart)))
        return (float("inf") if np.isnan(self.apart[k]) else float(self.apart[k])), float(self.time[k])


def paths(table: PrimitiveTable, robot: RobotModelConfig, backend: str = "mjx", **options: object) -> Paths:
    """One undisturbed trial of a primitive in `native` and in another backend.

    Raises:
      InputError: raised by the other backend.
    """
    places, time = [], np.zeros(0)
    spec = trial_spec(robot, boxes_of(table.request))
    for name, own in (("native", {}), (backend, options)):
        made = physics.make(name, spec, 1, fields=VARIED, **own)
        rolled = roll(made, table, robot, [Disturbance()], record=True)
        columns = [address(made.model, part) for part in (*(f"pos_{side}" for side in SIDES), "head")]
        places.append(np.stack([rolled.sensordata[0][:, at] for at in columns], axis=1))
        time = rolled.time
    return Paths(time, np.linalg.norm(places[0] - places[1], axis=2).max(axis=1))


def outcomes(
    table: PrimitiveTable,
    robot: RobotModelConfig,
    disturbances: Sequence[Disturbance],
    backend: str = "mjx",
    **options: object,
) -> Bool[np.ndarray, "2 B"]:
    """Which trials succeed in `native`, and which in another backend."""
    native = trials(table, robot, disturbances, record=False)
    other = trials(table, robot, disturbances, backend, record=False, **options)
    return np.stack([result.success(Tolerance()) for result in (native, other)])
