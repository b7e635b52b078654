"""How many arenas the next study needs, from the spread in a pilot."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np
import polars as pl
from scipy import stats
from statsmodels.stats.power import TTestPower

from jaxbiped.errors import InputError
from jaxbiped.statistics.comparison import paired
from jaxbiped.statistics.intervals import proportion
from jaxbiped.statistics.power import sample_size

MEASURES = ("success", "distance", "time")


@dataclass(frozen=True)
class Plan:
    """A number of arenas, and its basis."""

    measure: str  # one of MEASURES
    wanted: float  # difference to show [fraction], [m] or [s]
    power: float
    alpha: float
    pilot: int  # arenas of the pilot
    solved: int  # of these, solved by both
    spread: float  # success: share of arenas that one side alone solves; else standard deviation [m] or [s]
    spread_high: float  # upper end of its 95 % interval
    arenas: int
    arenas_high: int  # if the spread is at its upper end


def plan(
    frame: pl.DataFrame, first: str, second: str, measure: str, wanted: float, power: float = 0.8, alpha: float = 0.05
) -> Plan:
    """Number of arenas to show a difference of `wanted` with a given power.

    Success: McNemar's exact test, with the pilot's share of discordant arenas. Distance and time: the paired t test on
    arenas that both solved, with the pilot's standard deviation and share of such arenas.

    Args:
      frame: the pilot's rows, with two names in `strategy`.

    Raises:
      InputError: a number out of range, or a pilot that is not sufficient.
    """
    if measure not in MEASURES:
        raise InputError(f"must be one of {', '.join(MEASURES)}", field="measure", value=measure)
    if not 0 < wanted < (1 if measure == "success" else float("inf")):
        allowed = "must be above 0 and below 1" if measure == "success" else "must be above 0"
        raise InputError(allowed, field="wanted-difference", value=wanted)
    for name, value in (("power", power), ("level", 1 - alpha)):
        if not 0 < value < 1:
            raise InputError("must be above 0 and below 1", field=name, value=value)
    both, solved = paired(*(frame.filter(pl.col("strategy") == name) for name in (first, second)))
    if measure == "success":
        spread, high, counts = plan_success(both, wanted, power, alpha)
    else:
        differences = (solved[measure] - solved[f"{measure}_second"]).to_numpy()
        spread, high, pairs = plan_mean(differences, wanted, power, alpha)
        counts = [ceil(count * len(both) / len(solved)) for count in pairs]
    return Plan(measure, wanted, power, alpha, len(both), len(solved), spread, high, *counts)


def plan_success(both: pl.DataFrame, wanted: float, power: float, alpha: float) -> tuple[float, float, list[int]]:
    """Share of discordant arenas, the upper end of its interval, and the number of arenas for each of them."""
    discordant = int((both["success"] != both["success_second"]).sum())
    share = proportion(discordant, len(both))
    counts = []
    for spread in (share.estimate, share.high):
        spread = min(1.0, max(spread, wanted))  # a difference cannot exceed the discordant share
        counts.append(sample_size((spread + wanted) / 2, (spread - wanted) / 2, power, alpha))
    return share.estimate, share.high, counts


def plan_mean(differences: np.ndarray, wanted: float, power: float, alpha: float) -> tuple[float, float, list[int]]:
    """Standard deviation, the upper end of its interval (chi-square), and the number of pairs for each of them."""
    n = len(differences)
    if n < 2 or np.ptp(differences) == 0:
        message = "needs a pilot with two or more arenas that both solved and whose differences are not all equal"
        raise InputError(message, field="plan-power", value=n)
    spread = float(np.std(differences, ddof=1))
    high = spread * sqrt((n - 1) / stats.chi2.ppf(0.025, n - 1))
    return spread, high, [paired_t_sample_size(wanted, value, power, alpha) for value in (spread, high)]


def paired_t_sample_size(difference: float, spread: float, power: float = 0.8, alpha: float = 0.05) -> int:
    """Pairs for the two-sided paired t test: the smallest number with a power (non-central t) of at least `power`.

    Args:
      difference: true mean of the paired differences.
      spread: their standard deviation, in the same unit.
    """
    effect, test = abs(difference) / spread, TTestPower()
    # Starts at the normal approximation, which is at most a few pairs below the answer.
    n = max(2, ceil(((stats.norm.ppf(1 - alpha / 2) + stats.norm.ppf(power)) / effect) ** 2) - 2)
    while test.power(effect, n, alpha) < power:
        n += 1
    return n
