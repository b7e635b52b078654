"""Tests on pairs: published examples, false-positive rates under a true null, and empty or equal samples."""

import gc
import itertools

import numpy as np
import pytest
from scipy import stats

from jaxbiped.statistics.intervals import paired_difference
from jaxbiped.statistics.multiple_testing import holm
from jaxbiped.statistics.paired import (
    equivalent_mean,
    equivalent_success,
    improvement,
    mcnemar,
    metric_difference,
    signed_rank,
    success_difference,
)


def test_mcnemar_is_the_published_one():
    assert mcnemar(6, 16) == pytest.approx(0.052479, abs=5e-7)  # Fagerland et al. (2017), chapter 8: Cavo's table
    assert mcnemar(1, 7) == pytest.approx(0.0703, abs=5e-5)  # by hand: 2 (1 + 8) / 2^8
    assert mcnemar(0, 0) == 1.0


def test_success_difference_counts_the_discordant():
    first = np.array([True] * 59 + [True] * 6 + [False] * 16 + [False] * 80)
    second = np.array([True] * 59 + [False] * 6 + [True] * 16 + [False] * 80)
    result = success_difference(first, second)
    assert (result.estimate, result.n) == (pytest.approx(-10 / 161), 161)
    assert (result.low, result.p) == (paired_difference(6, 16, 161).low, mcnemar(6, 16))
    assert not success_difference(first[:0], second[:0]).valid


def test_signed_rank_of_wilcoxons_darwin_data():
    # Darwin's maize (Fisher, 1935), inches / 8: W = 24, exact two-sided p = 0.0413 with 15 pairs.
    plants = np.array([49, -67, 8, 16, 6, 23, 28, 41, 14, 29, 56, 24, 75, 60, -48], float)
    assert signed_rank(plants) == pytest.approx(0.0413, abs=5e-5)


def test_exact_signed_rank_counts_all_signs():
    differences = np.array([0.0, 1.0, -1.0, 2.0, 2.0, 3.0, 0.0, 5.0])
    ranks = stats.rankdata(np.abs(differences))  # Pratt: zeros are ranked, then left out
    moving = differences != 0
    sums = [np.sum(ranks[moving] * signs) for signs in itertools.product([0, 1], repeat=int(moving.sum()))]
    observed = np.sum(ranks[differences > 0])
    expected = 2 * min(np.mean(np.array(sums) >= observed), np.mean(np.array(sums) <= observed))
    assert signed_rank(differences) == pytest.approx(expected)


@pytest.mark.parametrize("n", [3, 20, 50])
def test_exact_signed_rank_without_ties_is_scipys(n):
    differences = np.random.default_rng(n).normal(0.3, 1.0, n)
    assert signed_rank(differences) == pytest.approx(stats.wilcoxon(differences, method="exact").pvalue, rel=1e-9)


def test_signed_rank_goes_over_into_the_normal_one():
    differences = np.round(np.random.default_rng(0).normal(0.2, 1.0, 50) * 4) / 4
    normal = stats.wilcoxon(differences, zero_method="pratt", method="asymptotic").pvalue
    assert signed_rank(differences) == pytest.approx(normal, rel=0.05)
    twice = np.tile(differences, 2)
    assert signed_rank(twice) == stats.wilcoxon(twice, zero_method="pratt").pvalue
    assert signed_rank(np.zeros(5)) == 1.0
    assert signed_rank(np.zeros(0)) is None


def test_improvement_counts_ties_half():
    result = improvement(np.array([-1.0] * 6 + [0.0] * 3 + [2.0]))
    assert result.estimate == pytest.approx(0.75)
    assert 0.4 < result.low < result.high < 1
    assert improvement(np.zeros(40)).estimate == 0.5
    assert improvement(-np.ones(40)).high == 1.0
    assert not improvement(np.zeros(0)).valid


def test_metric_difference_takes_rounding_for_a_tie():
    first = np.array([0.1 + 0.2, 1.0, 2.0, 3.0])
    result = metric_difference(first, np.array([0.3, 1.5, 2.5, 4.0]), seed=0)
    assert result.zeros == 1 and result.n == 4
    assert result.mean.estimate == pytest.approx(-0.5)
    empty = metric_difference(first[:0], first[:0], seed=0)
    assert (empty.n, empty.p, empty.mean.valid, empty.improvement.valid) == (0, None, False, False)


def test_holm_by_hand():
    # Sorted: 0.01 x 4, 0.02 x 3, 0.03 x 2, 0.04 x 1, each at least the one before.
    assert holm([0.04, 0.01, None, 0.03, 0.02]) == pytest.approx([0.06, 0.04, None, 0.06, 0.06], nan_ok=True)
    assert holm([]) == [] and holm([None]) == [None]


def rejection_tolerance(n, alpha=0.05):
    """Four binomial standard errors of a rejection rate of `alpha` in `n` simulations."""
    return 4 * np.sqrt(alpha * (1 - alpha) / n)


def test_false_positives_of_the_success_test_under_the_null():
    rng = np.random.default_rng(1)
    counts = rng.multinomial(512, [0.15, 0.15, 0.7], size=4000)
    rate = np.mean([mcnemar(int(a), int(b)) <= 0.05 for a, b, _ in counts])
    assert rate < 0.05 + rejection_tolerance(4000)
    assert rate > 0.03 - rejection_tolerance(4000)  # exact, so a little below nominal, but not useless


@pytest.mark.parametrize(("n", "tied"), [(40, True), (85, False), (85, True)])
def test_false_positives_of_the_signed_rank_under_the_null(n, tied):
    rng = np.random.default_rng(2)
    p = []
    for _ in range(1500):
        luck, a, b = rng.normal(size=(3, n))  # two exchangeable strategies that share an arena's luck
        differences = (luck + a) - (luck + b)
        p.append(signed_rank(np.round(differences * 2) / 2 if tied else differences))
    assert abs(np.mean(np.array(p) <= 0.05) - 0.05) < rejection_tolerance(1500)


def test_holm_holds_the_family_wise_rate_under_the_null(monkeypatch):
    monkeypatch.setattr(gc, "collect", lambda: 0)  # statsmodels collects garbage at each call: 0.1 s
    rng = np.random.default_rng(3)
    any_rejected = [min(holm(row.tolist())) <= 0.05 for row in rng.random((1500, 15))]
    assert np.mean(any_rejected) < 0.05 + rejection_tolerance(1500)


def test_the_interval_and_the_exact_test_tell_the_same_story():
    """Tango's interval excludes 0 wherever the exact test rejects (the score test is never more conservative)."""
    for a in range(0, 30, 3):
        for b in range(0, 30, 2):
            result = paired_difference(a, b, 85)
            if mcnemar(a, b) <= 0.05:
                assert result.low > 0 or result.high < 0


def test_equivalence_of_success_agrees_with_its_interval():
    for first_only, second_only in [(25, 28), (5, 5), (0, 40), (30, 22), (0, 0)]:
        result = equivalent_success(first_only, second_only, 618, margin=0.03)
        assert (result.p < 0.05) == (result.low > -0.03 and result.high < 0.03)
    assert not equivalent_success(0, 0, 0, 0.05).valid


def test_equivalence_of_success_rejects_at_its_nominal_rate_on_the_margin():
    counts = np.random.default_rng(4).multinomial(400, [0.15, 0.10, 0.75], size=1500)
    tables, indices = np.unique(counts, axis=0, return_inverse=True)
    rejected = np.array([equivalent_success(int(a), int(b), 400, 0.05).p <= 0.05 for a, b, _ in tables])[indices]
    assert abs(np.mean(rejected) - 0.05) < rejection_tolerance(1500) + 0.005  # asymptotic score test


def test_equivalence_of_means_is_two_t_tests():
    differences = np.random.default_rng(5).normal(0.1, 1.0, 50)
    lower = stats.ttest_1samp(differences, -0.5, alternative="greater").pvalue
    upper = stats.ttest_1samp(differences, 0.5, alternative="less").pvalue
    result = equivalent_mean(differences, 0.5)
    assert result.p == pytest.approx(max(lower, upper))
    assert (result.p < 0.05) == (result.low > -0.5 and result.high < 0.5)
    assert equivalent_mean(np.zeros(9), 0.5).p is None
    assert equivalent_mean(np.zeros(1), 0.5).low is None
    assert not equivalent_mean(np.zeros(0), 0.5).valid
