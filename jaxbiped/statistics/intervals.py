"""Estimates with intervals: proportions, paired differences of proportions, means and medians."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from math import sqrt

import numpy as np
from jaxtyping import Float
from scipy import optimize, stats

BOOTSTRAP_LIMIT = 5_000  # samples; above it, BCa's jackknife costs n^2 and the analytic intervals are as good


@dataclass(frozen=True)
class Estimate:
    """A number with its interval. Values that could not be computed are None, never NaN."""

    estimate: float | None
    low: float | None = None
    high: float | None = None
    p: float | None = None  # p-value of the two-sided test of "no difference"
    p_holm: float | None = None  # `p` corrected for all tests of its table
    n: int = 0  # number of samples
    valid: bool = True  # there is an estimate; the interval may still be None


NOTHING = Estimate(None, valid=False)


def proportion(successes: int, n: int, level: float = 0.95) -> Estimate:
    """A proportion with Wilson's score interval (Wilson, 1927); empty if n is 0."""
    if n == 0:
        return NOTHING
    interval = stats.binomtest(successes, n).proportion_ci(level, method="wilson")
    return Estimate(successes / n, float(interval.low), float(interval.high), n=n)


def score_statistic(difference: float, first_only: int, second_only: int, n: int) -> tuple[float, float]:
    """Tango's score for a hypothetical paired difference: (observed minus expected count, its variance).

    Tango (1998), Statistics in Medicine 17, 891-908: the nuisance parameter is the probability of "second
    only", at its maximum likelihood under the hypothesis.
    """
    linear = (2 * n - first_only + second_only) * difference - first_only - second_only
    constant = -second_only * difference * (1 - difference)
    second = (sqrt(max(linear * linear - 8 * n * constant, 0.0)) - linear) / (4 * n)
    return first_only - second_only - n * difference, n * (2 * second + difference * (1 - difference))


def paired_difference(first_only: int, second_only: int, n: int, level: float = 0.95) -> Estimate:
    """The difference of two proportions on the same `n` pairs, with Tango's asymptotic score interval (1998).

    Args:
      first_only, second_only: pairs where only the first, only the second, succeeded.
      n: all pairs, concordant ones included.

    The interval stays inside [-1, 1], depends only on the discordant counts, and keeps its width when both are zero.
    """
    if n == 0:
        return NOTHING
    z, estimate = stats.norm.ppf(0.5 + level / 2), (first_only - second_only) / n

    def excess(difference: float, side: float) -> float:
        score, variance = score_statistic(difference, first_only, second_only, n)
        return score - side * z * sqrt(max(variance, 0.0))

    def limit(side: float) -> float:
        # The score is 0 / 0 at the estimate itself if no pair is discordant: start slightly beside it.
        inner, outer = estimate - side * 1e-12, -side
        if side * inner <= -1 or side * excess(inner, side) >= 0:
            return outer
        return float(np.clip(optimize.brentq(excess, *sorted((outer, inner)), args=(side,), xtol=1e-13), -1, 1))

    return Estimate(estimate, limit(1.0), limit(-1.0), n=n)


def mean_and_median(
    samples: Float[np.ndarray, "n"], *, seed: int, resamples: int = 4999, level: float = 0.95
) -> tuple[Estimate, Estimate]:
    """The mean and the median of samples, each with its BCa bootstrap interval (`scipy.stats.bootstrap`).

    Both use the same resamples. There is no interval for fewer than three samples, nor if all samples are equal. If the
    median's jackknife is constant (heavy ties), its acceleration is undefined and the interval is the percentile
    interval of the bootstrap. Above `BOOTSTRAP_LIMIT` samples the intervals are Student's t for the mean and binomial
    order statistics for the median.

    Args:
      seed: seed of the resampling.
    """
    n = len(samples)
    if n == 0:
        return NOTHING, NOTHING
    values = float(np.mean(samples)), float(np.median(samples))
    if n < 3 or np.ptp(samples) == 0:
        return Estimate(values[0], n=n), Estimate(values[1], n=n)
    limits = analytic(samples, level) if n > BOOTSTRAP_LIMIT else bootstrap(samples, seed, resamples, level)
    return tuple(
        Estimate(value, float(low), float(high), n=n) for value, (low, high) in zip(values, limits, strict=True)
    )


def mean_estimate(
    samples: Float[np.ndarray, "n"], *, seed: int, resamples: int = 4999, level: float = 0.95
) -> Estimate:
    """The mean alone, as in `mean_and_median` except for its resamples; takes a fifth of the time."""
    n = len(samples)
    if n == 0:
        return NOTHING
    value = float(np.mean(samples))
    if n < 3 or np.ptp(samples) == 0:
        return Estimate(value, n=n)
    if n > BOOTSTRAP_LIMIT:
        low, high = stats.t.interval(level, n - 1, loc=value, scale=stats.sem(samples))
    else:
        batch, rng = max(1, 2_000_000 // n), np.random.default_rng(seed)
        options = {"n_resamples": resamples, "confidence_level": level, "method": "BCa", "batch": batch, "rng": rng}
        low, high = stats.bootstrap((samples,), np.mean, **options).confidence_interval
    return Estimate(value, float(low), float(high), n=n)


def bootstrap(samples: Float[np.ndarray, "n"], seed: int, resamples: int, level: float) -> Float[np.ndarray, "2 2"]:
    """Limits (low, high) of the mean and of the median by BCa."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # SciPy warns if the acceleration is 0 / 0: handled below
        result = stats.bootstrap(
            (samples,),
            lambda sample, axis: np.stack([np.mean(sample, axis), np.median(sample, axis)]),
            n_resamples=resamples,
            confidence_level=level,
            method="BCa",
            batch=max(1, 2_000_000 // len(samples)),  # at most 16 MB of resamples at a time
            rng=np.random.default_rng(seed),
        )
    limits = np.stack([result.confidence_interval.low, result.confidence_interval.high], axis=-1)
    tails = [(1 - level) / 2, (1 + level) / 2]
    percentiles = np.quantile(result.bootstrap_distribution, tails, axis=-1).T
    return np.where(np.isfinite(limits), limits, percentiles)


def analytic(samples: Float[np.ndarray, "n"], level: float) -> Float[np.ndarray, "2 2"]:
    """Limits (low, high) of the mean by Student's t and of the median by order statistics, for many samples."""
    n = len(samples)
    mean = stats.t.interval(level, n - 1, loc=np.mean(samples), scale=stats.sem(samples))
    rank = int(stats.binom.ppf((1 - level) / 2, n, 0.5))  # this many samples may lie below the median, and above
    ordered = np.partition(samples, [rank - 1, n - rank])
    return np.array([mean, (ordered[rank - 1], ordered[n - rank])])
