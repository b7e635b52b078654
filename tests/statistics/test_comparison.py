"""Strategies against each other: counted by hand on small frames, and under a null."""

import gc

import numpy as np
import polars as pl
import pytest

from jaxbiped.errors import InputError
from jaxbiped.statistics.comparison import ALL, compare, default_pairs
from jaxbiped.statistics.multiple_testing import holm
from jaxbiped.statistics.paired import signed_rank, success_difference
from jaxbiped.statistics.schema import CODES, STRATEGIES
from tests.study.synthetic import rows

FRAME = rows(120)
COMPARISON = compare(FRAME, resamples=400)


def test_the_question_comes_first():
    assert default_pairs(STRATEGIES)[:2] == (("bump_aware", "floor_only"), ("full", "bump_aware"))
    assert len(default_pairs(STRATEGIES)) == 5
    assert default_pairs(("bump_aware", "floor_only")) == (("bump_aware", "floor_only"),)
    assert default_pairs(("full",)) == ()


def test_a_pair_is_the_numpy_count():
    pair = COMPARISON.pair("bump_aware", "floor_only")
    sides = {name: FRAME.filter(pl.col("strategy") == name).sort("arena") for name in ("bump_aware", "floor_only")}
    a, b = (side["success"].to_numpy() for side in sides.values())
    assert (pair.first_only, pair.second_only) == (np.sum(a & ~b), np.sum(b & ~a))
    assert pair.success.estimate == pytest.approx(a.mean() - b.mean())
    both = a & b
    for name in ("distance", "time"):
        first, second = (side[name].to_numpy()[both] for side in sides.values())
        metric = getattr(pair, name)
        assert metric.n == both.sum()
        assert metric.mean.estimate == pytest.approx(np.mean(first - second), abs=1e-4)
        assert metric.median.estimate == pytest.approx(np.median(first - second), abs=1e-4)
        assert metric.mean.low < metric.mean.estimate < metric.mean.high


def test_a_summary_is_the_count():
    for summary in COMPARISON.summaries:
        assert sum(summary.codes) == summary.n
        assert summary.codes[CODES.index("reached")] == summary.distance.n
    summary = COMPARISON.summary("full")
    reachable = FRAME.filter((pl.col("strategy") == "full") & pl.col("reachable"))
    assert summary.success_of_reachable.estimate == pytest.approx(reachable["success"].mean())


def test_a_strategys_own_means_have_intervals_over_all_arenas():
    frame = rows(90, strategies=("full", "floor_only"))
    found = compare(frame, seed=5, resamples=200)
    again = compare(frame, seed=5, resamples=200)
    for name in ("full", "floor_only"):
        reached = frame.filter((pl.col("strategy") == name) & pl.col("success"))
        for metric in ("distance", "time"):
            mean = getattr(found.summary(name), metric)
            assert mean == getattr(again.summary(name), metric) and mean.n == len(reached)
            assert mean.low < mean.estimate < mean.high and mean.estimate == pytest.approx(reached[metric].mean())
            error = reached[metric].std() / np.sqrt(len(reached))  # the interval is about as wide as the t interval
            assert mean.high - mean.low == pytest.approx(2 * 1.98 * error, rel=0.25)
    assert found.summary("full", found.strata("family")[0]).time.low is None


def test_strata_split_the_arenas():
    assert COMPARISON.strata("all") == (ALL,)
    assert len(COMPARISON.strata("family")) == 6
    assert len(COMPARISON.strata("difficulty")) == 3
    for kind in ("family", "difficulty"):
        sizes = [COMPARISON.summary("full", stratum).n for stratum in COMPARISON.strata(kind)]
        assert sum(sizes) == 120
        assert max(sizes) - min(sizes) <= 1


def test_equal_difficulties_are_one_stratum():
    frame = FRAME.with_columns(pl.lit(0.5, pl.Float32).alias("difficulty"))
    assert len(compare(frame, resamples=50).strata("difficulty")) == 1


def test_holm_runs_over_a_whole_table():
    pairs = [pair for pair in COMPARISON.pairs if pair.stratum == ALL]
    p = sorted(test.p for pair in pairs for test in (pair.success, pair.distance, pair.time))
    corrected = sorted(test.p_holm for pair in pairs for test in (pair.success, pair.distance, pair.time))
    assert len(p) == 15
    assert corrected[0] == pytest.approx(min(1, 15 * p[0]))


def test_only_shared_arenas_are_paired():
    lost = (pl.col("strategy") == "floor_only") & (pl.col("arena") < 20)
    pair = compare(FRAME.filter(~lost), resamples=50).pair("bump_aware", "floor_only")
    assert pair.success.n == 100


def test_the_order_of_the_rows_does_not_matter():
    shuffled = FRAME.sample(fraction=1.0, shuffle=True, seed=1)
    assert compare(shuffled, resamples=100) == compare(FRAME, resamples=100)


def test_nobody_reached_is_no_number():
    null = pl.lit(None, pl.Float64)
    frame = FRAME.with_columns(
        pl.lit("stuck").alias("code"), pl.lit(False).alias("success"), null.alias("distance"), null.alias("time")
    )
    pair = compare(frame, resamples=50).pair("full", "floor_only")
    assert (pair.success.estimate, pair.success.p) == (0.0, 1.0)
    assert not pair.time.mean.valid and pair.time.p_holm is None


def test_one_arena_and_one_strategy_pass():
    assert compare(FRAME.filter(pl.col("arena") == 3), resamples=50).pair("full", "blind_stop").success.n == 1
    assert compare(FRAME.filter(pl.col("strategy") == "full")).pairs == ()


def test_what_is_not_there_is_named():
    with pytest.raises(InputError, match=r"point.*got 7"):
        compare(FRAME, point=7)
    with pytest.raises(InputError, match="must be one of full"):
        compare(FRAME, pairs=[("full", "lucky")])


def test_two_names_for_one_strategy_are_rarely_told_apart(monkeypatch):
    """Under a true null, Holm's family-wise rate over success, distance and time stays nominal."""
    monkeypatch.setattr(gc, "collect", lambda: 0)  # statsmodels collects garbage at each call: 0.1 s
    names = ("bump_aware", "floor_only")
    sides = [rows(80, strategies=names).filter(pl.col("strategy") == name).sort("arena") for name in names]
    success, distance, time = (
        np.stack([side[c].to_numpy() for side in sides]) for c in ("success", "distance", "time")
    )
    rng, rejected, simulations = np.random.default_rng(0), 0, 400
    for _ in range(simulations):
        swap = rng.random(80) < 0.5  # exchanging the names within an arena makes the null true
        first, second = np.where(swap, *success), np.where(swap, *success[::-1])
        both = first & second
        p = [success_difference(first, second).p]
        p += [
            signed_rank(np.where(swap, values[0] - values[1], values[1] - values[0])[both])
            for values in (distance, time)
        ]
        rejected += min(holm(p)) <= 0.05
    assert rejected / simulations < 0.05 + 4 * np.sqrt(0.05 * 0.95 / simulations)
