"""Tests on pairs: two strategies on the same arenas."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from scipy import stats
from statsmodels.stats.weightstats import DescrStatsW

from jaxbiped.statistics.intervals import NOTHING, Estimate, mean_and_median, paired_difference, score_statistic

EXACT_LIMIT = 50  # largest number of samples for the exact signed-rank test


@dataclass(frozen=True)
class PairedMetric:
    """One metric on the arenas that both strategies solved. Differences are first minus second.

    `p` is Wilcoxon's signed-rank test's, `p_holm` is corrected for all tests of the table.
    """

    mean: Estimate
    median: Estimate
    improvement: Estimate  # P(first < second) + P(equal) / 2
    p: float | None
    p_holm: float | None
    n: int  # arenas that both solved
    zeros: int  # of these, arenas where both are equal


def mcnemar(first_only: int, second_only: int) -> float:
    """Two-sided p of McNemar's exact test: discordant pairs are a fair coin (McNemar, 1947). 1 without such pairs."""
    discordant = first_only + second_only
    return float(stats.binomtest(first_only, discordant).pvalue) if discordant else 1.0


def success_difference(first: Bool[np.ndarray, "n"], second: Bool[np.ndarray, "n"], level: float = 0.95) -> Estimate:
    """P(first succeeds) - P(second succeeds) on the same arenas: Tango's score interval, McNemar's exact p."""
    first_only, second_only = int(np.sum(first & ~second)), int(np.sum(~first & second))
    difference = paired_difference(first_only, second_only, len(first), level)
    return replace(difference, p=mcnemar(first_only, second_only)) if difference.valid else difference


def signed_rank(differences: Float[np.ndarray, "n"]) -> float | None:
    """Two-sided p of Wilcoxon's signed-rank test; None without samples.

    Zeros are ranked and then left out of both sums (Pratt, 1959). Up to `EXACT_LIMIT` samples the test is exact, given
    the ranks; above, it is `scipy.stats.wilcoxon`'s normal approximation, corrected for ties. If all differences are
    zero, p is 1.
    """
    if len(differences) == 0:
        return None
    if not np.any(differences):
        return 1.0
    if len(differences) <= EXACT_LIMIT:
        return exact_signed_rank(differences)
    return float(stats.wilcoxon(differences, zero_method="pratt", method="asymptotic").pvalue)


def exact_signed_rank(differences: Float[np.ndarray, "n"]) -> float:
    """The same p from the distribution of the rank sum over all signs, with ties and zeros as they are.

    SciPy has it for samples without ties; with ties it uses permutations, which take seconds.
    """
    ranks = np.round(2 * stats.rankdata(np.abs(differences))).astype(int)  # doubled: ties have half ranks
    counts = np.ones(1)  # sign patterns by the doubled sum of the positive ranks
    for rank in ranks[differences != 0]:
        counts = np.pad(counts, (0, rank)) + np.pad(counts, (rank, 0))
    observed = int(np.sum(ranks[differences > 0]))
    tail = min(np.sum(counts[: observed + 1]), np.sum(counts[observed:]))
    return float(min(1.0, 2 * tail / np.sum(counts)))


def improvement(differences: Float[np.ndarray, "n"], level: float = 0.95) -> Estimate:
    """The probability that the first is smaller than the second on one arena, with ties counted half.

    It is 1/2 + (P(smaller) - P(greater)) / 2, so the interval is Tango's for that paired difference, halved.
    """
    score = paired_difference(int(np.sum(differences < 0)), int(np.sum(differences > 0)), len(differences), level)
    if not score.valid:
        return NOTHING
    estimate, low, high = (0.5 + value / 2 for value in (score.estimate, score.low, score.high))
    return Estimate(estimate, low, high, n=score.n)


def metric_difference(
    first: Float[np.ndarray, "n"],
    second: Float[np.ndarray, "n"],
    *,
    seed: int,
    resamples: int = 4999,
    level: float = 0.95,
) -> PairedMetric:
    """Compare a metric where smaller is better, on the `n` arenas that both solved. `seed` seeds the bootstrap."""
    # Sums of steps in another order differ by rounding (float32): values within 0.1 mm or 0.1 ms are ties.
    differences = np.round(first - second, 4)
    mean, median = mean_and_median(differences, seed=seed, resamples=resamples, level=level)
    return paired_metric(differences, mean, median, level)


def paired_metric(differences: Float[np.ndarray, "n"], mean: Estimate, median: Estimate, level: float) -> PairedMetric:
    """The complete comparison of differences whose mean and median have been estimated."""
    return PairedMetric(
        mean=mean,
        median=median,
        improvement=improvement(differences, level),
        p=signed_rank(differences),
        p_holm=None,
        n=len(differences),
        zeros=int(np.sum(differences == 0)),
    )


def equivalent_success(first_only: int, second_only: int, n: int, margin: float, alpha: float = 0.05) -> Estimate:
    """Two one-sided score tests (Tango, 1998) that the success rates differ by less than `margin` [fraction].

    `p` is the greater of the two; the interval is the one at level 1 - 2 alpha, which lies inside the margin exactly
    when p < alpha.
    """
    if n == 0:
        return NOTHING
    z = []
    for bound in (-margin, margin):
        score, variance = score_statistic(bound, first_only, second_only, n)
        z.append(score / np.sqrt(variance))
    p = max(stats.norm.sf(z[0]), stats.norm.cdf(z[1]))
    return replace(paired_difference(first_only, second_only, n, 1 - 2 * alpha), p=float(p))


def equivalent_mean(differences: Float[np.ndarray, "n"], margin: float, alpha: float = 0.05) -> Estimate:
    """Two one-sided t tests (Schuirmann, 1987) that the mean paired difference is within +-`margin`.

    Fields as in `equivalent_success`; no test for fewer than two samples or if all samples are equal.
    """
    n = len(differences)
    if n == 0:
        return NOTHING
    if n < 2 or np.ptp(differences) == 0:
        return Estimate(float(np.mean(differences)), n=n)
    described = DescrStatsW(differences)
    low, high = described.tconfint_mean(2 * alpha)
    p = described.ttost_mean(-margin, margin)[0]
    return Estimate(float(np.mean(differences)), float(low), float(high), p=float(p), n=n)
