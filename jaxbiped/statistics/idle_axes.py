"""Stretches of a swept axis over which nothing changes: every mission is the same at several successive values."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import polars as pl

from jaxbiped.statistics.schema import SCHEMA

SAME = 1e-6  # that numbers of two missions may differ by
# What a mission came to. Costs of plans are not among it: they change with the costs where the way does not.
NUMBERS = ("walked", "elapsed", "measurements", "decisions", "goal_distance", "pose_error", "yaw_error")


@dataclass(frozen=True)
class IdleSpan:
    """Successive values of an axis, with the same missions at each of them."""

    field: str
    low: float
    high: float
    values: int  # of the axis, from low to high
    whole: bool  # whether these are all that it has


def idle_spans(frame: pl.DataFrame, points: pl.DataFrame, axes: Mapping[str, Sequence[str]]) -> tuple[IdleSpan, ...]:
    """The stretches of each axis over which no mission changes, whatever the other axes are at.

    Args:
      frame: rows of `schema.SCHEMA`.
      points: as `store.read_points` gives them.
      axes: the field of each axis, and the fields that change together with it.
    """
    return tuple(itertools.chain(*(spans_of(frame, points, field, axes[field]) for field in axes)))


def spans_of(frame: pl.DataFrame, points: pl.DataFrame, field: str, together: Sequence[str]) -> Iterator[IdleSpan]:
    """Those of one axis."""
    others = [name for name in points.columns if name not in ("point", field, *together)]
    key = [*others, "arena", "strategy"]
    # Metrics are left out: one may be called as a field that is swept.
    rows = frame.select(name for name in frame.columns if name in SCHEMA).join(points, on="point")
    table = rows.unique([field, *key])  # a point of the config's own values may come twice
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
    """Whether all missions that both have are the same, and there are any."""
    both = one.join(other, on=key, suffix="_other")
    if both.is_empty():
        return False
    alike = pl.col("code") == pl.col("code_other")
    for name in NUMBERS:
        apart = (pl.col(name) - pl.col(f"{name}_other")).abs()
        alike &= (apart <= SAME) | (pl.col(name).is_nan() & pl.col(f"{name}_other").is_nan())
    return bool(both.select(alike.all()).item())
