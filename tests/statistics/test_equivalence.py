"""Equivalence in strata against the tests themselves, and its error rate by simulation."""

import numpy as np
import polars as pl
import pytest

from jaxbiped.errors import InputError
from jaxbiped.statistics.comparison import ALL, compare_named
from jaxbiped.statistics.equivalence import equivalences
from jaxbiped.statistics.paired import equivalent_mean, equivalent_success
from tests.study.synthetic import rows

FRAME = rows(240)
PAIR = ("full", "bump_aware")


def test_each_stratum_is_its_own_test_and_corrected_among_its_kind():
    found = equivalences(FRAME, *PAIR, {"success": 0.2, "time": 60.0})
    overall = {item.measure: item for item in found if item.stratum == ALL}
    pair = compare_named(FRAME, PAIR, [PAIR], resamples=20).pair(*PAIR)
    direct = equivalent_success(pair.first_only, pair.second_only, pair.success.n, 0.2)
    assert overall["success"].difference.p == direct.p == overall["success"].difference.p_holm
    assert overall["success"].difference.n == 240 and overall["time"].difference.n == pair.time.n
    families = [item for item in found if item.stratum.kind == "family" and item.measure == "success"]
    assert len(families) == 6
    raw, adjusted = ([getattr(item.difference, name) for item in families] for name in ("p", "p_holm"))
    assert min(adjusted) == pytest.approx(min(1.0, 6 * min(raw)))
    assert all(after >= before for before, after in zip(raw, adjusted, strict=True))


def test_the_interval_lies_within_the_margin_exactly_where_it_is_shown():
    for margin in (0.1, 0.6):
        (found, *_) = equivalences(FRAME.head(300), *PAIR, {"success": margin})
        inside = -margin < found.difference.low and found.difference.high < margin
        assert found.shown == inside


def test_two_that_differ_by_the_margin_are_called_equivalent_no_more_often_than_stated():
    # At the very margin the error rate is greatest; 400 studies of 200 arenas, four standard errors.
    rng, limit = np.random.default_rng(2), 0.05 + 4 * np.sqrt(0.05 * 0.95 / 400)
    counts = rng.multinomial(200, [0.2, 0.1, 0.7], size=400)
    wrong = np.mean([equivalent_success(int(a), int(b), 200, 0.1).p < 0.05 for a, b, _ in counts])
    assert wrong <= limit
    samples = rng.normal(30.0, 60.0, (400, 50))
    assert np.mean([equivalent_mean(sample, 30.0).p < 0.05 for sample in samples]) <= limit
    assert np.mean([equivalent_mean(sample - 30.0, 30.0).p < 0.05 for sample in samples]) > 0.9


def test_identical_sides_are_not_tested_but_equal():
    frame = pl.concat(
        [FRAME.filter(pl.col("strategy") == "full").with_columns(strategy=pl.lit(name)) for name in ("a", "b")]
    )
    found = {item.measure: item for item in equivalences(frame, "a", "b", {"success": 0.05, "time": 5.0})[:2]}
    assert found["success"].shown and found["time"].difference.estimate == 0 and found["time"].difference.p is None


@pytest.mark.parametrize(
    ("margins", "said"),
    [
        ({"success": 0.0}, "margin-success"),
        ({"success": 1.0}, "below 1"),
        ({"distance": -0.1}, "margin-distance"),
        ({"time": float("nan")}, "margin-time"),
        ({"cost": 1.0}, "must be one of success"),
    ],
)
def test_margins_that_are_none(margins, said):
    with pytest.raises(InputError, match=said):
        equivalences(FRAME, *PAIR, margins)
