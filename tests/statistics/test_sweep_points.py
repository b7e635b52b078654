"""What each sweep point came to, against plain counts of its rows."""

import numpy as np
import polars as pl
import pytest

from jaxbiped.statistics.intervals import proportion
from jaxbiped.statistics.paired import metric_difference, success_difference
from jaxbiped.statistics.sweep_points import own_point, pointwise
from tests.study.synthetic import rows

STRATEGIES = ("full", "floor_only")
CONFIG = {"mission": {"costs": {"c3": 10.0}, "pitch": 0.05}, "population": {"bump_width": None}}


def swept(values, strategies=STRATEGIES, arenas=60):
    """Rows of as many points as there are values, and the table of points."""
    frames = [
        rows(arenas, seed=k, strategies=strategies).with_columns(pl.lit(k, pl.Int32).alias("point"))
        for k in range(len(values))
    ]
    points = pl.DataFrame({"point": range(len(values)), "costs.c3": values})
    return pl.concat(frames), points.with_columns(pl.col("point").cast(pl.Int32), pl.col("costs.c3").cast(pl.Float64))


def column(frame, point, strategy, name):
    return frame.filter((pl.col("point") == point) & (pl.col("strategy") == strategy)).sort("arena")[name].to_numpy()


def test_each_point_is_counted_by_itself():
    frame, points = swept([5.0, 10.0, 20.0])
    result = pointwise(frame.sample(fraction=1, shuffle=True, seed=1), points, CONFIG, resamples=99)
    assert [point.index for point in result.points] == [0, 1, 2] and result.reference == 1
    assert result.fields == ("costs.c3",) and result.question == STRATEGIES
    for point in result.points:
        assert point.values == {"costs.c3": [5.0, 10.0, 20.0][point.index]}
        reached = {name: column(frame, point.index, name, "success") for name in STRATEGIES}
        for name in STRATEGIES:
            assert point.success[name] == proportion(int(reached[name].sum()), 60)
        assert point.pair.success == success_difference(reached["full"], reached["floor_only"])
        both = reached["full"] & reached["floor_only"]
        times = [column(frame, point.index, name, "time")[both] for name in STRATEGIES]
        assert point.pair.time.mean.estimate == pytest.approx(np.mean(times[0] - times[1]), abs=1e-3)
        assert point.pair.time.n == both.sum() and point.pair.time.mean.low <= point.pair.time.mean.estimate


def test_points_are_paired_with_the_reference():
    frame, points = swept([5.0, 10.0])
    result = pointwise(frame, points, CONFIG, resamples=99)
    assert result.points[1].change == {}  # the reference itself
    for name in STRATEGIES:
        here, there = (column(frame, k, name, "success") for k in (0, 1))
        change = result.points[0].change[name]
        assert change.success == success_difference(here, there)
        both = here & there
        walked = [column(frame, k, name, "distance")[both] for k in (0, 1)]
        expected = metric_difference(*walked, seed=0, resamples=99)
        assert change.distance.mean.estimate == pytest.approx(expected.mean.estimate)


def test_points_without_rows_and_strategies_alone():
    frame, points = swept([5.0, 10.0, 20.0], strategies=("full",))
    result = pointwise(frame.filter(pl.col("point") != 1), points, CONFIG, resamples=99)
    assert [point.index for point in result.points] == [0, 2]
    assert result.question is None and all(point.pair is None and point.change == {} for point in result.points)
    half = frame.filter((pl.col("point") != 2) | (pl.col("arena") < 30))  # a study that was stopped
    assert pointwise(half, points, CONFIG, resamples=99).points[2].success["full"].n == 30


def test_the_same_rows_give_the_same_result():
    frame, points = swept([5.0, 10.0])
    first, second = (pointwise(frame, points, CONFIG, seed=7, resamples=99) for _ in range(2))
    assert first == second


@pytest.mark.parametrize(
    ("columns", "found"),
    [
        ({"costs.c3": [1.0, 10.0], "pitch": [0.05, 0.05]}, 1),
        ({"costs.c3": [1.0, 10.0], "pitch": [0.05, 0.1]}, None),
        ({"population.bump_width": [0.1, 0.2]}, None),
        ({}, None),
    ],
)
def test_the_point_of_the_config_itself(columns, found):
    assert own_point(pl.DataFrame({"point": [0, 1]} | columns), CONFIG) == found
