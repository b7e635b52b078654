"""What a row may hold."""

import polars as pl
import pytest

from jaxbiped.errors import InputError
from jaxbiped.statistics.schema import SCHEMA, validate
from tests.study.synthetic import rows

FRAME = rows(12)


def test_a_good_frame_comes_back_in_order():
    shuffled = FRAME.select(reversed(FRAME.columns))
    assert validate(shuffled).schema == SCHEMA
    assert validate(FRAME.clear()).height == 0


def set_first(column, value):
    """The frame with another value in the first row that reached, or did not, as the column needs."""
    index = pl.int_range(pl.len()) == FRAME["success"].arg_max()
    return FRAME.with_columns(
        pl.when(index).then(pl.lit(value)).otherwise(pl.col(column)).cast(SCHEMA[column]).alias(column)
    )


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("code", "lost"),
        ("strategy", "<b>lucky</b>"),
        ("family", "../maze"),
        ("success", False),
        ("code", "fell"),
        ("distance", None),
        ("distance", float("nan")),
        ("time", float("inf")),
        ("time", -1.0),
        ("walked", float("nan")),
        ("goal_distance", -0.1),
        ("pose_error", -0.1),
        ("reachable", None),
        ("oracle_cost", float("inf")),
        ("difficulty", float("nan")),
        ("measurements", None),
    ],
)
def test_a_bad_value_is_named(column, value):
    with pytest.raises(InputError, match=r"arena \d+, strategy") as error:
        validate(set_first(column, value), file="rows/part-00003.parquet")
    assert "part-00003" in str(error.value)


def test_nan_is_allowed_where_the_mission_overflowed():
    row = FRAME.filter(~pl.col("success")).head(1)
    nan = pl.lit(float("nan"))
    row = row.with_columns(pl.lit("invalid").alias("code"), nan.alias("walked"), nan.alias("elapsed"))
    assert validate(row).height == 1


def test_columns_and_types_are_named():
    with pytest.raises(InputError, match="elapsed: column missing"):
        validate(FRAME.drop("elapsed"))
    with pytest.raises(InputError, match="colour: unknown column"):
        validate(FRAME.with_columns(pl.lit(1).alias("colour")))
    with pytest.raises(InputError, match="arena: must be of type Int64"):
        validate(FRAME.with_columns(pl.col("arena").cast(pl.Int32)))


def test_a_row_comes_once():
    with pytest.raises(InputError, match="has one row"):
        validate(pl.concat([FRAME, FRAME.tail(1)]))
