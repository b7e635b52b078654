"""The landmark model of the ray-cast sensor, fitted to landmarks that were found in rendered pairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from jaxbiped.arenas.arena import CIRCLE, SQUARE
from jaxbiped.sensing.config import LandmarkConfig

LEAST_SD, LEAST_PER_METRE = 0.0003, 0.0001  # [m], [m/m] lower bounds of the model: a print is no better than that
BINS = 6  # range bins in which errors are averaged
FEWEST = 12  # fewest landmarks for a limit or an error


@dataclass(frozen=True)
class Sight:
    """One landmark that was in view of both cameras."""

    kind: int
    distance: float  # [m] from the robot's axis
    error: tuple[float, float] | None  # [m] of forward and left; None if it was not found


def fit_landmarks(sights: Sequence[Sight], base: LandmarkConfig) -> LandmarkConfig:
    """How errors grow with range, and the ranges in which landmarks are found; `base` if there are too few.

    The standard deviation is the straight line through those of `BINS` bins of equal numbers; the limits are those that
    are correct for the most landmarks.
    """
    found = [sight for sight in sights if sight.error is not None]
    values = {}
    if len(found) >= FEWEST:
        distance = np.array([sight.distance for sight in found])
        error = np.array([sight.error for sight in found])
        values |= growth(distance, np.sqrt(np.mean(error**2, axis=1)))
    nearest = []
    for kind, name in ((CIRCLE, "furthest_circle"), (SQUARE, "furthest_square")):
        mine = [sight for sight in sights if sight.kind == kind]
        distance = np.array([sight.distance for sight in mine])
        seen = np.array([sight.error is not None for sight in mine], bool)
        if len(mine) >= FEWEST and seen.any():
            low, high = limits(distance, seen)
            values[name] = high
            nearest.append((len(mine), low))
    if nearest:
        values["nearest"] = max(nearest)[1]
    return base.model_copy(update={name: round(float(value), 4) for name, value in values.items()})


def growth(distance: Float[np.ndarray, "n"], error: Float[np.ndarray, "n"]) -> dict[str, float]:
    """Standard deviation at range 0, and its growth per metre."""
    order = np.array_split(np.argsort(distance), BINS)
    x = np.array([distance[part].mean() for part in order])
    y = np.array([np.sqrt(np.mean(error[part] ** 2)) for part in order])
    slope, at_zero = np.polyfit(x, y, 1)
    slope = max(slope, LEAST_PER_METRE)
    at_zero = max(np.mean(y - slope * x), LEAST_SD)
    return {"sd": at_zero, "sd_per_metre": slope}


def limits(distance: Float[np.ndarray, "n"], seen: Bool[np.ndarray, "n"]) -> tuple[float, float]:
    """Smallest and greatest range [m] such that most landmarks between them are found, and most others are not."""
    order = np.argsort(distance)
    distance, gain = distance[order], np.where(seen[order], 1, -1)
    score = np.concatenate([[0], np.cumsum(gain)])  # of the first n
    last = int(np.argmax(score[1:])) + 1
    first = int(np.argmin(score[:last]))
    low = distance[first] if first else 0.0
    return float(low), float(distance[last - 1])
