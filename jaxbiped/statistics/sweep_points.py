"""The results of each point of a sweep: success of each strategy, and paired differences on the same arenas."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import polars as pl

from jaxbiped.statistics.comparison import ALL, QUESTION, PairComparison, compare_pair
from jaxbiped.statistics.intervals import Estimate, proportion
from jaxbiped.statistics.schema import ordered


@dataclass(frozen=True)
class PointResult:
    """One sweep point."""

    index: int
    values: dict[str, float]  # field: value
    success: dict[str, Estimate]  # by strategy
    pair: PairComparison | None  # the two strategies of the question on the same arenas; None with fewer
    change: dict[str, PairComparison]  # by strategy: this point minus the reference, on the same arenas


@dataclass(frozen=True)
class SweepResult:
    """All points of a sweep that have rows."""

    strategies: tuple[str, ...]
    points: tuple[PointResult, ...]
    reference: int | None  # index of the point with the config's own values, if there is one
    level: float
    seed: int
    resamples: int

    @property
    def fields(self) -> tuple[str, ...]:
        """The swept fields."""
        return tuple(self.points[0].values)

    @property
    def question(self) -> tuple[str, str] | None:
        """The two strategies that are compared; None with fewer."""
        return asked(self.strategies)


def asked(strategies: tuple[str, ...]) -> tuple[str, str] | None:
    """The project's pair if both are present, else the first two; None with fewer."""
    if set(QUESTION) <= set(strategies):
        return QUESTION
    return strategies[:2] if len(strategies) > 1 else None


def pointwise(
    frame: pl.DataFrame,
    points: pl.DataFrame,
    config: Mapping[str, Any],
    *,
    seed: int = 0,
    resamples: int = 999,
    level: float = 0.95,
) -> SweepResult:
    """Evaluate each sweep point separately, without correction for their number.

    Args:
      frame: rows of `schema.SCHEMA`.
      points: as returned by `store.read_points`.
      config: the manifest's config, which gives the reference.
      seed: seed of the bootstraps; each has its own stream from it.
    """
    strategies = ordered(frame["strategy"])
    pair, reference = asked(strategies), own_point(points, config)
    sides = {key: rows for key, rows in frame.sort("arena").partition_by("point", "strategy", as_dict=True).items()}
    rng, results = np.random.default_rng(seed), []
    for row in points.iter_rows(named=True):
        index = row.pop("point")
        here = {name: sides[index, name] for name in strategies if (index, name) in sides}
        if not here:
            continue

        def against(first: tuple[str, pl.DataFrame], second: tuple[str, pl.DataFrame]) -> PairComparison:
            options = {"seed": int(rng.integers(2**32)), "resamples": resamples, "level": level}
            return compare_pair(ALL, first, second, **options)

        change = {
            name: against((f"point {index}", rows), (f"point {reference}", sides[reference, name]))
            for name, rows in here.items()
            if reference is not None and index != reference and (reference, name) in sides
        }
        whole = pair is not None and set(pair) <= set(here)
        results.append(
            PointResult(
                index=index,
                values=row,
                success={name: proportion(int(rows["success"].sum()), len(rows), level) for name, rows in here.items()},
                pair=against((pair[0], here[pair[0]]), (pair[1], here[pair[1]])) if whole else None,
                change=change,
            )
        )
    return SweepResult(strategies, tuple(results), reference, level, seed, resamples)


def own_point(points: pl.DataFrame, config: Mapping[str, Any]) -> int | None:
    """The index of the sweep point at which each field has its value in the config."""
    own = {name: value_of(config, name) for name in points.columns if name != "point"}
    for row in points.iter_rows(named=True):
        if own and all(value is not None and row[name] == value for name, value in own.items()):
            return row["point"]
    return None


def value_of(config: Mapping[str, Any], name: str) -> float | None:
    """The value of a dotted field of a stored config, `mission` fields without the prefix; None if it is missing."""
    for tree in (config.get("mission", {}), config):
        for part in name.split("."):
            tree = tree.get(part) if isinstance(tree, Mapping) else None
        if isinstance(tree, int | float):
            return tree
    return None
