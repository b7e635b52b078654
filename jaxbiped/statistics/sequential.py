"""Watch a difference while a study runs, and stop when its interval is narrow enough, at a valid error rate.

An interval made for a fixed number of arenas is wrong more often than stated if it is looked at repeatedly. A
confidence sequence is a series of intervals that all hold simultaneously with the stated probability, whoever looks
when and stops why. This one is the asymptotic confidence sequence of Waudby-Smith, Arbour, Sinha, Kennedy and Ramdas,
"Time-uniform central limit theory and asymptotic confidence sequences" (Annals of Statistics 52, 2024), for
the mean of independent samples.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import e, log, sqrt

import numpy as np
import polars as pl
from jaxtyping import Float

from jaxbiped.core.names import MEASURES as MEASURES
from jaxbiped.statistics.comparison import paired
from jaxbiped.statistics.intervals import NOTHING, Estimate

FIRST_LOOK = 100  # samples: with fewer, "asymptotic" means nothing


@dataclass(frozen=True)
class Goal:
    """The difference to watch, and when it is known well enough."""

    measure: str  # one of MEASURES
    first: str  # strategies; the difference is first minus second
    second: str
    width: float  # of the whole interval: [fraction], [m] or [s]
    level: float = 0.95  # probability that all intervals hold simultaneously


@dataclass(frozen=True)
class Watch:
    """The state so far: counts and sums, not samples."""

    arenas: int = 0  # with rows of both strategies
    n: int = 0  # samples: all arenas for success, those that both solved for distance and time
    mean: float = 0.0
    squares: float = 0.0  # sum of squared deviations from the mean
    intensity: float | None = None  # rho squared of the sequence, fixed at the first look
    estimate: Estimate = NOTHING  # at the last look

    @property
    def width(self) -> float | None:
        """Width of the interval; None before there is one."""
        return None if self.estimate.low is None else self.estimate.high - self.estimate.low


def enough(watch: Watch, goal: Goal) -> bool:
    """Whether the interval is as narrow as requested."""
    return watch.width is not None and watch.width <= goal.width


def look(watch: Watch, goal: Goal, frame: pl.DataFrame) -> Watch:
    """The watch after one more shard's rows; each shard comes once, in any order that does not depend on results."""
    both, solved = paired(*(frame.filter(pl.col("strategy") == name) for name in (goal.first, goal.second)))
    watch = replace(watch, arenas=watch.arenas + len(both))
    if goal.measure == "success":
        samples = both["success"].to_numpy().astype(float) - both["success_second"].to_numpy()
    else:
        samples = np.round(solved[goal.measure].to_numpy() - solved[f"{goal.measure}_second"].to_numpy(), 4)
    return observe(watch, goal, samples)


def observe(watch: Watch, goal: Goal, samples: Float[np.ndarray, "n"]) -> Watch:
    """The watch after more samples, with the interval of the mean at that time."""
    watch = add(watch, samples)
    spread = variance(watch, goal.measure)
    if watch.n < FIRST_LOOK or spread <= 0:
        return watch
    alpha = 1 - goal.level
    if watch.intensity is None:
        # Narrowest about when the goal will be reached, as predicted at the first look. The theorem requires it fixed
        # beforehand; fixing it from the first samples is covered by the simulation in the tests.
        watch = replace(watch, intensity=tightest_at(arenas_for(spread, goal.width, alpha), alpha))
    half = radius(spread, watch.n, watch.intensity, alpha)
    limits = watch.mean - half, watch.mean + half
    if goal.measure == "success":
        limits = max(-1.0, limits[0]), min(1.0, limits[1])
    return replace(watch, estimate=Estimate(watch.mean, *limits, n=watch.n))


def add(watch: Watch, samples: Float[np.ndarray, "n"]) -> Watch:
    """Add samples to mean and sum of squares (Chan, Golub and LeVeque, 1983)."""
    if len(samples) == 0:
        return watch
    n, more = watch.n + len(samples), float(np.mean(samples))
    apart = more - watch.mean
    squares = watch.squares + float(np.sum((samples - more) ** 2)) + apart**2 * watch.n * len(samples) / n
    return replace(watch, n=n, mean=watch.mean + apart * len(samples) / n, squares=squares)


def variance(watch: Watch, measure: str) -> float:
    """Variance of one sample. For success, half an arena is added to each cell of the 2 x 2 table (Agresti and Min,
    2005, Statistics in Medicine 24, 729-740): otherwise a first look at arenas solved by both would claim certainty."""
    if watch.n < 2:
        return 0.0
    if measure != "success":
        return watch.squares / (watch.n - 1)
    discordant = watch.squares + watch.n * watch.mean**2  # the samples are -1, 0 and 1
    n = watch.n + 2
    return (discordant + 1) / n - (watch.n * watch.mean / n) ** 2


def radius(variance: float, n: float | int, intensity: float, alpha: float) -> float:
    """Half the width after `n` samples: the Gaussian mixture of the paper, with rho squared = `intensity`."""
    scaled = n * intensity + 1
    return sqrt(2 * variance * scaled / (n * n * intensity) * (log(sqrt(scaled) / alpha)))


def tightest_at(n: float | int, alpha: float) -> float:
    """The intensity that minimises `radius` after `n` samples.

    With u = n rho^2 + 1, the squared radius is proportional to u / (u - 1) (log u - 2 log alpha), smallest where
    u - log u = 1 - 2 log alpha, that is u = -W_{-1}(-alpha^2 / e).
    """
    return (least(alpha) - 1) / n


def arenas_for(variance: float, width: float, alpha: float) -> float:
    """Samples after which the interval, tuned to that moment, has this width."""
    return max(float(FIRST_LOOK), variance * least(alpha) * (2 / width) ** 2)


def least(alpha: float) -> float:
    """u of `tightest_at`: at that moment the radius is sqrt(variance u / n), where a fixed one has z^2 instead of u."""
    from scipy.special import lambertw

    return float(-lambertw(-(alpha**2) / e, -1).real)
