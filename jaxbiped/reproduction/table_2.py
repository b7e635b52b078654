"""Table 2 of the paper: the primitives, simulated."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from jaxbiped.biped.config import RobotModelConfig
from jaxbiped.biped.gait import generate
from jaxbiped.biped.primitive_catalogue import FIVE, Pace, catalogue
from jaxbiped.biped.spread import MILD
from jaxbiped.biped.trial import Disturbance, Tolerance
from jaxbiped.biped.verify import trials
from jaxbiped.reproduction.paper import TABLE_2
from jaxbiped.statistics.intervals import Estimate, proportion

NAMES = FIVE
TITLES = {  # of our primitives: the paper's names, and its times [s]
    "straight": ("Straight-forward", TABLE_2.straight),
    "turn": ("Turn-direction", TABLE_2.turn),
    "step_up": ("Step-up-bump", TABLE_2.step_up),
    "step_down": ("Step-down-bump", TABLE_2.step_down),
    "gate": ("Pass-gate", TABLE_2.pass_gate),
}


@dataclass(frozen=True)
class Verified:
    """One primitive."""

    name: str
    duration: float  # [s] as simulated
    asked: tuple[float, float, float]  # [m, m, rad] requested: ahead, left, turn
    rise: float  # [m]
    error: tuple[float, float, float]  # [m, m, rad] undisturbed end pose minus the request
    trials: int
    successes: int
    margin: float  # [m] margin of the zero moment point, undisturbed
    least_margin: float  # [m] on the mild set

    @property
    def title(self) -> str:
        """The paper's name."""
        return TITLES[self.name][0]

    @property
    def paper(self) -> float:
        """[s] in Table 2."""
        return TITLES[self.name][1]

    @property
    def success(self) -> Estimate:
        """Success on the mild set."""
        return proportion(self.successes, self.trials)

    @property
    def carries(self) -> str:
        """The displacement as text."""
        ahead, _, turn = self.asked
        text = f"{100 * ahead:.0f} cm" if ahead else f"{math.degrees(turn):.0f}°"
        return text + (f", {100 * abs(self.rise):.0f} cm {'up' if self.rise > 0 else 'down'}" if self.rise else "")

    @property
    def off(self) -> str:
        """The error [mm] as text."""
        return f"{1e3 * math.hypot(*self.error[:2]):.1f}"


def verify(name: str, robot: RobotModelConfig, draws: int, seed: int, pace: Pace = "paper") -> Verified:
    """Simulate one of the five, undisturbed and `draws` times under mild disturbances."""
    table = generate(catalogue(pace)[name], robot)
    made = trials(table, robot, [Disturbance(), *MILD.draws(draws, seed)])
    good = made.success(Tolerance())
    request = table.request
    return Verified(
        name=name,
        duration=float(table.duration),
        asked=(request.forward, request.left, request.turn),
        rise=request.rise,
        error=tuple(float(v) for v in made.error[0]),
        trials=draws,
        successes=int(good[1:].sum()),
        margin=float(made.zmp_margin[0]),
        least_margin=float(np.min(made.zmp_margin[1:])),
    )


def verify_all(robot: RobotModelConfig, draws: int, seed: int, done: Callable[[], None]) -> tuple[Verified, ...]:
    """All five; `done` is called after each."""
    found = []
    for name in NAMES:
        found.append(verify(name, robot, draws, seed))
        done()
    return tuple(found)
