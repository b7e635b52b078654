"""Ranges of a swept axis over which nothing changes: every mission is the same at several successive values."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import polars as pl

from jaxbiped.statistics.schema import SCHEMA

SAME = 1e-6  # largest difference between the numbers of equal missions
# The outcome of a mission. It excludes plan costs, which change with the costs even if the path does not.
NUMBERS = ("walked", "elapsed", "measurements", "decisions", "goal_distance", "pose_error", "yaw_error")


@dataclass(frozen=True)
class IdleSpan:
    """Successive values of an axis, with the same missions at each of them."""

    field: str
    low: float
    high: float
    values: int  # of the axis, from low to high
    whole: bool  # whether these are all values of the axis


def idle_spans(frame: pl.DataFrame, points: pl.DataFrame, axes: Mapping[str, Sequence[str]]) -> tuple[IdleSpan, ...]:
    """The ranges of each axis over which no mission changes, at all values of the other axes.

    Args:
      frame: rows of `schema.SCHEMA`.
      points: as returned by `store.read_points`.
      axes: the field of each axis, and the fields that change together with it.
    """
    return tuple(itertools.chain(*(spans_of(frame, points, field, axes[field]) for field in axes)))


def spans_of(frame: pl.DataFrame, points: pl.DataFrame, field: str, together: Sequence[str]) -> Iterator[IdleSpan]:
    """The ranges of one axis."""
    others = [name for name in points.columns if name not in ("point", field, *together)]
    key = [*others, "arena", "strategy"]
    # Metrics are left out: one may have the name of a swept field.
    rows = frame.select(name for name in frame.columns if name in SCHEMA).join(points, on="point")
    table = rows.unique([field, *key])  # a point with the config's own values may occur twice
    sides = {value: rows for (value,), rows in table.partition_by(field, as_dict=True).items()}
    values = sorted(sides)
    same = [is_same(sides[low], sides[high], key) for low, high in itertools.pairwise(values)]
    start = 0
    for alike, group in itertools.groupby(same):
        count = len(list(group))
        if alike:
            yield IdleSpan(field, values[start], values[start + count], count + 1, count + 1 == len(values))
        start += count


def is_same(one: pl.DataFrame, other: pl.DataFrame, key: Sequence[str]) -> bool:
    """Whether there are missions that both have, and all of them are the same."""
    both = one.join(other, on=key, suffix="_other")
    if both.is_empty():
        return False
    alike = pl.col("code") == pl.col("code_other")
    for name in NUMBERS:
        apart = (pl.col(name) - pl.col(f"{name}_other")).abs()
        alike &= (apart <= SAME) | (pl.col(name).is_nan() & pl.col(f"{name}_other").is_nan())
    return bool(both.select(alike.all()).item())
