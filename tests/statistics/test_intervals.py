"""Intervals against published tables, and their coverage by simulation."""

import numpy as np
import pytest
from scipy import stats

from jaxbiped.statistics.intervals import NOTHING, bootstrap, mean_and_median, paired_difference, proportion
from jaxbiped.statistics.paired import improvement

# Of N simulated intervals at level 0.95, the share that covers is within 4 binomial standard errors of the truth.
# `slack` is the documented small-sample error of the method on top of that.


def assert_covers(hits, slack, level=0.95):
    error = 4 * np.sqrt(level * (1 - level) / len(hits))
    assert abs(np.mean(hits) - level) < error + slack, f"coverage {np.mean(hits):.4f}"


@pytest.mark.parametrize(
    ("successes", "n", "low", "high"),
    # Newcombe (1998), Statistics in Medicine 17, 857-872, Table I, method 3.
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_wilson_is_the_published_one(successes, n, low, high):
    result = proportion(successes, n)
    assert (result.low, result.high) == pytest.approx((low, high), abs=5e-5)


@pytest.mark.parametrize(
    ("first_only", "second_only", "n", "level", "low", "high", "places"),
    [
        (0, 1, 44, 0.90, -0.096, 0.037, 3),  # Tango (1998): contact lenses 43, 0, 1, 0
        (9, 3, 32, 0.95, -0.027, 0.390, 3),  # Tango (1998): cross-over trial 4, 9, 3, 16
        (12, 2, 50, 0.95, 0.0611, 0.3447, 4),  # Tango's method on Newcombe's example (1998) 36, 12, 2, 0
        (6, 16, 161, 0.95, -0.1240, -0.0054, 4),  # Fagerland et al. (2017), chapter 8: Cavo's 59, 6, 16, 80
        (1, 7, 21, 0.95, -0.517, -0.026, 3),  # Fagerland et al. (2014): Bentur's 1, 1, 7, 12
    ],
)
def test_paired_difference_is_the_published_one(first_only, second_only, n, level, low, high, places):
    result = paired_difference(first_only, second_only, n, level)
    assert (round(result.low, places), round(result.high, places)) == (low, high)
    mirrored = paired_difference(second_only, first_only, n, level)
    assert (-mirrored.high, -mirrored.low) == pytest.approx((result.low, result.high), abs=1e-9)


@pytest.mark.parametrize(("first_only", "second_only", "n"), [(0, 0, 1), (0, 0, 50), (50, 0, 50), (0, 9, 9), (1, 0, 1)])
def test_paired_difference_at_the_edges_keeps_a_width_and_its_bounds(first_only, second_only, n):
    result = paired_difference(first_only, second_only, n)
    assert -1 <= result.low <= result.estimate <= result.high <= 1
    assert result.high - result.low > 1 / (n + 4)
    if first_only == second_only == 0:
        z2 = stats.norm.ppf(0.975) ** 2
        assert result.high == pytest.approx(z2 / (n + z2)) == -result.low  # by hand: |d| n = z sqrt(n |d| (1 - |d|))


def test_paired_difference_of_a_million_pairs():
    result = paired_difference(300_000, 299_000, 1_000_000)
    wald = 1.959964 * np.sqrt(599_000 - 1000**2 / 1e6) / 1e6
    assert (result.low, result.high) == pytest.approx((0.001 - wald, 0.001 + wald), rel=1e-3)


def test_wilson_covers():
    rng = np.random.default_rng(1)
    hits = []
    for _ in range(2000):
        p = rng.uniform(0.02, 0.98)  # averaged over p, as Wilson's coverage oscillates with it
        result = proportion(int(rng.binomial(85, p)), 85)
        hits.append(result.low <= p <= result.high)
    assert_covers(hits, slack=0.003)


@pytest.mark.parametrize(("n", "first", "second"), [(85, 0.15, 0.05), (512, 0.2, 0.17), (85, 0.02, 0.0)])
def test_paired_difference_covers(n, first, second):
    counts = np.random.default_rng(2).multinomial(n, [first, second, 1 - first - second], size=2000)
    tables, indices = np.unique(counts, axis=0, return_inverse=True)
    results = [paired_difference(int(a), int(b), n) for a, b, _ in tables]
    hits = np.array([result.low <= first - second <= result.high for result in results])[indices]
    if second:
        assert_covers(hits, slack=0.005)
    else:
        assert np.mean(hits) > 0.95  # fewer than two discordant pairs expected: conservative


def ties(rng, n):
    """Differences as missions give them: multiples of 5 cm, many zeros, a long tail on one side."""
    return np.where(rng.random(n) < 0.3, 0.0, np.round(rng.gamma(1.5, 6.0, n) - 4.0) * 0.05)


def smooth(rng, n):
    return rng.gamma(2.0, 1.0, n)


def coverage(draw, simulations, n, resamples=600):
    rng = np.random.default_rng(3)
    population = draw(np.random.default_rng(4), 2_000_000)
    mean, median = population.mean(), np.median(population)
    hits = np.zeros((2, simulations), bool)
    for index in range(simulations):
        for row, result, truth in zip(
            (0, 1), mean_and_median(draw(rng, n), seed=index, resamples=resamples), (mean, median), strict=True
        ):
            hits[row, index] = result.low - 1e-9 <= truth <= result.high + 1e-9
    return hits


@pytest.mark.parametrize(("draw", "simulations"), [(smooth, 500), (ties, 500)])
def test_bca_covers(draw, simulations):
    mean, median = coverage(draw, simulations, n=80)
    assert_covers(mean, slack=0.02)  # second-order accurate: an error of order 1 / n (Efron, 1987)
    if draw is smooth:
        assert_covers(median, slack=0.03)
    else:
        assert np.mean(median) > 0.92  # an atom at the median makes any interval conservative


@pytest.mark.slow
@pytest.mark.parametrize("n", [30, 120])
def test_bca_covers_long(n):
    mean, median = coverage(smooth, 4000, n, resamples=1500)
    assert_covers(mean, slack=0.02 if n == 30 else 0.008)
    assert_covers(median, slack=0.03)


def test_probability_of_improvement_covers():
    rng = np.random.default_rng(5)
    hits = []
    for _ in range(1000):
        differences = np.round(rng.normal(-0.4, 1.0, 85) * 2) / 2  # ties at zero
        result = improvement(differences)
        hits.append(result.low <= TRUE_IMPROVEMENT <= result.high)
    assert_covers(hits, slack=0.005)


# P(round < 0) + P(round == 0) / 2 for N(-0.4, 1) rounded to halves: the cut points are -0.25 and 0.25.
TRUE_IMPROVEMENT = (stats.norm.cdf(-0.25, -0.4) + stats.norm.cdf(0.25, -0.4)) / 2


def test_bootstrap_is_seeded():
    samples = smooth(np.random.default_rng(0), 60)
    assert mean_and_median(samples, seed=1) == mean_and_median(samples, seed=1)
    assert mean_and_median(samples, seed=1) != mean_and_median(samples, seed=2)


def test_mean_by_bca_is_scipys_own():
    samples = smooth(np.random.default_rng(0), 60)
    expected = stats.bootstrap((samples,), np.mean, n_resamples=999, rng=np.random.default_rng(7)).confidence_interval
    assert bootstrap(samples, 7, 999, 0.95)[0] == pytest.approx((expected.low, expected.high), rel=1e-12)


@pytest.mark.parametrize("samples", [[], [1.0], [1.0, 2.0], [3.0] * 40, [0.0] * 3])
def test_degenerate_samples_have_no_interval(samples):
    for result in mean_and_median(np.array(samples, float), seed=0):
        assert result.valid == bool(samples) and result.n == len(samples)
        assert result.low is None and result.high is None


def test_a_median_that_ties_hide_still_has_finite_limits():
    samples = np.array([0.0] * 95 + [1.0] * 5)
    mean, median = mean_and_median(samples, seed=0)
    assert mean.low > 0 and np.isfinite(mean.high)
    assert (median.low, median.high) == (0.0, 0.0)


def test_many_samples_have_analytic_intervals_close_to_the_bootstrap():
    samples = smooth(np.random.default_rng(0), 6000)
    exact = mean_and_median(samples, seed=0)
    for result, (low, high) in zip(exact, bootstrap(samples, 0, 999, 0.95), strict=True):
        assert (result.low, result.high) == pytest.approx((low, high), abs=0.15 * (high - low))


def test_nothing_of_nothing():
    assert proportion(0, 0) == paired_difference(0, 0, 0) == NOTHING
