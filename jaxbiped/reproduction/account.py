"""How a mission spent its time, read from its log: each kind of action with its count, distance and seconds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jaxbiped.biped.primitive_catalogue import PAPER
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.recorded_driver import NAMES, Mission
from jaxbiped.motion.config import DurationConfig
from jaxbiped.motion.grid_units import CELL, EIGHTH
from jaxbiped.motion.primitives import Primitive
from jaxbiped.reproduction.paper import Experiment

STRAIGHT, DIAGONAL, ASIDE = "straight", "diagonal", "aside and back"
UP, DOWN, GATE, TURN, MEASURE = "step up", "step down", "gate", "turn", "measure"
KINDS = (STRAIGHT, DIAGONAL, ASIDE, UP, DOWN, GATE, TURN, MEASURE)
GATE_CARRIES = PAPER["gate"].forward  # [m] displacement of the simulated primitive
SMALL = 1e-3  # [s] largest error of single-precision sums
PLAYED_AS = {
    NAMES[Primitive.STEP_UP_BUMP]: UP,
    NAMES[Primitive.STEP_DOWN_BUMP]: DOWN,
    NAMES[Primitive.PASS_GATE]: GATE,
}


@dataclass(frozen=True)
class Part:
    """Actions of one kind."""

    count: int = 0
    metres: float = 0.0  # requested
    seconds: float = 0.0

    def __add__(self, other: Part) -> Part:
        return Part(self.count + other.count, self.metres + other.metres, self.seconds + other.seconds)


@dataclass(frozen=True)
class Record:
    """The figures of one mission of an experiment; its log is drawn, and then dropped."""

    number: int  # of the experiment; 0 for another scene
    strategy: str
    seed: int
    code: Code
    distance: float  # [m] truly walked
    moving: float  # [s] of everything except measuring
    measurements: int
    parts: dict[str, Part]

    @property
    def reached(self) -> bool:
        """Whether its figures can be compared."""
        return self.code == Code.REACHED

    def time(self, measure: float) -> float:
        """[s] with a given time for a measurement [s]. No decision depends on it, so no mission needs to be
        repeated."""
        return self.moving + self.measurements * measure


def record(item: Experiment | int, strategy: str, seed: int, mission: Mission, durations: DurationConfig) -> Record:
    """The figures of a mission that was timed by `durations`."""
    return Record(
        number=item if isinstance(item, int) else item.number,
        strategy=strategy,
        seed=seed,
        code=mission.code,
        distance=mission.distance,
        moving=mission.time - mission.measurements * durations.measure,
        measurements=mission.measurements,
        parts=parts(mission, durations),
    )


def parts(mission: Mission, durations: DurationConfig) -> dict[str, Part]:
    """The account for each of `KINDS`; their seconds sum to the mission's time."""
    found = dict.fromkeys(KINDS, Part())
    before = 0.0
    for k, played in enumerate(mission.played):
        spent = played.time - before - durations.measure
        before = played.time
        found[MEASURE] += Part(1, 0.0, durations.measure)
        if spent <= SMALL:  # it only looked, or the mission had ended
            continue
        turning = abs(played.turn) / EIGHTH * durations.turn
        if turning > SMALL:
            found[TURN] += Part(1, 0.0, turning)
        kind = PLAYED_AS.get(played.name) or walked(mission.log.estimated_xyyaw[k, 2] + played.turn, played.length)
        if spent - turning > SMALL:
            found[kind] += Part(1, abs(played.length), spent - turning)
    return found


def walked(heading: float, length: float) -> str:
    """The kind of walk on the floor: along the grid, across its cells, or sideways or backward.

    Args:
      heading: [rad] in the world.
      length: [m] forward.
    """
    if length <= 0:
        return ASIDE
    off = abs((heading + math.pi / 4) % (math.pi / 2) - math.pi / 4)
    return DIAGONAL if off > math.pi / 8 else STRAIGHT


@dataclass(frozen=True)
class Measuring:
    """The one free parameter, the time of a measurement, and how well it explains the published times."""

    seconds: float
    missions: int  # number of missions used
    residuals: dict[int, float]  # experiment to [s]: the mission shown minus the paper's
    alone: dict[int, float]  # experiment to [s]: the value from this experiment alone


def fit_measuring(
    records: Sequence[Record], experiments: Sequence[Experiment], shown: dict[int, Record]
) -> Measuring | None:
    """Least squares over all missions that reached their goal: time = moving + measurements x t, with t >= 0.

    Args:
      records: missions of any experiments.
      experiments: those with a published time.
      shown: the one record of each experiment that tables show.

    Returns:
      None if no mission of a published experiment reached its goal.
    """
    wanted = {item.number: 60 * item.minutes for item in experiments}
    used = [each for each in records if each.number in wanted and each.reached]
    if not used:
        return None
    counts = np.array([each.measurements for each in used], float)
    left = np.array([wanted[each.number] - each.moving for each in used])
    seconds = max(0.0, float(counts @ left / (counts @ counts)))
    figures = {number: shown[number] for number in wanted if number in shown and shown[number].reached}
    return Measuring(
        seconds=seconds,
        missions=len(used),
        residuals={number: each.time(seconds) - wanted[number] for number, each in figures.items()},
        alone={number: (wanted[number] - each.moving) / each.measurements for number, each in figures.items()},
    )


def other_reading(each: Record) -> Record:
    """A mission timed as if Table 2's 48 s for a gate were for 15 cm instead of 5, the length of our own primitive.

    The table gives no length. The cost C2 = 5 suggests 48 s per cell; but 48 s is also three cells of 16 s.
    """
    part = each.parts[GATE]
    spared = part.seconds * (1 - CELL / GATE_CARRIES)
    parts = each.parts | {GATE: replace(part, seconds=part.seconds - spared)}
    return replace(each, moving=each.moving - spared, parts=parts)


def typical(records: Sequence[Record]) -> Record:
    """The mission to show for an experiment: of those that reached the goal, the one with the median time.

    If none did, the first. For an even number, the faster of the middle two.
    """
    reached = [each for each in records if each.reached]
    if not reached:
        return records[0]
    order = sorted(reached, key=lambda each: each.time(0.0))
    return order[(len(order) - 1) // 2]
