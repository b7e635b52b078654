"""Stretches of an axis at which every mission is the same."""

import itertools

import polars as pl
import pytest

from jaxbiped.statistics.idle_axes import IdleSpan, idle_spans
from tests.study.synthetic import rows

FRAME = rows(12, strategies=("full", "floor_only"))


def swept(values, effect):
    """Points at each combination of the values of fields, as much slower as `effect` says."""
    combinations = [dict(zip(values, row, strict=True)) for row in itertools.product(*values.values())]
    frames = [
        FRAME.with_columns(pl.lit(k, pl.Int32).alias("point"), pl.col("elapsed") + effect(**point))
        for k, point in enumerate(combinations)
    ]
    columns = {name: [float(point[name]) for point in combinations] for name in values}
    points = pl.DataFrame({"point": range(len(combinations))} | columns)
    return pl.concat(frames), points.with_columns(pl.col("point").cast(pl.Int32))


@pytest.mark.parametrize(
    ("effect", "expected"),
    [
        (lambda c: c, ()),
        (lambda c: min(c, 20), (IdleSpan("c", 20.0, 80.0, 3, False),)),
        (lambda c: 0, (IdleSpan("c", 5.0, 80.0, 5, True),)),
        (
            lambda c: {5: 1, 10: 1, 20: 2, 40: 3, 80: 3}[c],
            (IdleSpan("c", 5, 10, 2, False), IdleSpan("c", 40, 80, 2, False)),
        ),
    ],
    ids=["all differ", "from a value on", "nothing at all", "at both ends"],
)
def test_stretches_of_one_axis(effect, expected):
    frame, points = swept({"c": (5, 10, 20, 40, 80)}, effect)
    assert idle_spans(frame.sample(fraction=1, shuffle=True, seed=0), points, {"c": ()}) == expected


def test_an_axis_is_idle_only_where_it_is_at_all_values_of_the_others():
    frame, points = swept({"a": (1, 2, 3), "b": (1, 2)}, lambda a, b: a if b == 1 else 0)
    assert idle_spans(frame, points, {"a": (), "b": ()}) == ()
    frame, points = swept({"a": (1, 2, 3), "b": (1, 2)}, lambda a, b: b)
    assert idle_spans(frame, points, {"a": (), "b": ()}) == (IdleSpan("a", 1.0, 3.0, 3, True),)


def test_fields_that_change_together_are_one_axis():
    frame, points = swept({"a": (1, 2)}, lambda a: 0)
    points = points.with_columns(d=pl.col("a") * 10)
    assert idle_spans(frame, points, {"a": ("d",)}) == (IdleSpan("a", 1.0, 2.0, 2, True),)


def test_missions_that_end_otherwise_are_not_the_same():
    frame, points = swept({"a": (1, 2)}, lambda a: 0)
    changed = (pl.col("point") == 1) & (pl.col("arena") == 3) & (pl.col("strategy") == "full")
    frame = frame.with_columns(pl.when(changed).then(pl.lit("planner_failed")).otherwise("code").alias("code"))
    assert idle_spans(frame, points, {"a": ()}) == ()
