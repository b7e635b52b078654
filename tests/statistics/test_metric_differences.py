"""Metrics of any size on the arenas where both sides have them, against plain NumPy."""

import numpy as np
import polars as pl
import pytest
from scipy import stats

from jaxbiped.statistics.metric_differences import metric_means, metric_pairs, without_rounding

OPTIONS = {"seed": 3, "resamples": 199, "level": 0.95}


def side(values, name="gap"):
    return pl.DataFrame({"arena": range(len(values)), name: pl.Series(values, dtype=pl.Float64)})


@pytest.mark.parametrize("scale", [1e-12, 1e-7, 1.0, 1e9])
def test_the_size_of_a_number_does_not_matter(scale):
    rng = np.random.default_rng(0)
    first, second = rng.normal(1.0, 0.1, 40), rng.normal(1.1, 0.1, 40)
    found = metric_pairs(side(first * scale), side(second * scale), ["gap"], **OPTIONS)["gap"]
    assert found.mean.estimate / scale == pytest.approx(np.mean(first - second))
    assert found.p == pytest.approx(stats.wilcoxon(first - second, method="exact").pvalue)
    assert found.zeros == 0 and found.mean.low / scale < np.mean(first - second) < found.mean.high / scale


def test_what_differs_by_rounding_is_a_tie():
    values = np.array([0.0, 1e-9, 1.0, 123456.0, -7.0])
    np.testing.assert_array_equal(without_rounding(values, values * (1 + 1e-7)), np.zeros(5))
    np.testing.assert_array_equal(without_rounding(values, values + 1.0), values - (values + 1.0))


def test_only_arenas_where_both_have_a_number_count():
    first = side([1.0, None, 3.0, 4.0]).with_columns(arena=pl.Series([5, 6, 7, 8]))
    second = side([2.0, 2.0, None, 4.0]).with_columns(arena=pl.Series([8, 6, 7, 5]))  # in another order
    found = metric_pairs(first, second, ["gap"], **OPTIONS)["gap"]
    assert (found.n, found.mean.estimate) == (2, pytest.approx(((1.0 - 4.0) + (4.0 - 2.0)) / 2))
    assert metric_means(first, ["gap"])["gap"].n == 3


@pytest.mark.parametrize("values", [[], [None], [None, None]])
def test_without_numbers_nothing_is_said(values):
    found = metric_pairs(side(values), side(values), ["gap"], **OPTIONS)["gap"]
    assert found.n == 0 and not found.mean.valid and found.p is None
    assert not metric_means(side(values), ["gap"])["gap"].valid


@pytest.mark.parametrize("values", [[1.0], [1.0, 1.0, 1.0, 1.0]])
def test_one_arena_and_ties_have_no_interval(values):
    found = metric_pairs(side(values), side(np.array(values) - 1.0), ["gap"], **OPTIONS)["gap"]
    assert found.mean.estimate == 1.0 and found.mean.low is None
