"""Metrics other than success, distance and time: their means, and differences on the same arenas."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
import polars as pl
from jaxtyping import Float

from jaxbiped.statistics.intervals import NOTHING, Estimate, mean_estimate
from jaxbiped.statistics.multiple_testing import holm
from jaxbiped.statistics.paired import PairedMetric, paired_metric

SECOND = "#second"  # suffix of the second side's columns; no column name ends like this
ROUNDING = 1e-6  # relative to the greater number: closer values are ties, since sums of floats depend on their order


def metric_means(rows: pl.DataFrame, names: Sequence[str]) -> dict[str, Estimate]:
    """The mean of each column over the rows that have a number there."""
    found = {}
    for name in names:
        values = rows[name].drop_nulls()
        found[name] = Estimate(float(values.mean()), n=len(values)) if len(values) else NOTHING
    return found


def metric_pairs(
    first: pl.DataFrame, second: pl.DataFrame, names: Sequence[str], *, seed: int, resamples: int, level: float
) -> dict[str, PairedMetric]:
    """Differences (first minus second) of each column on the arenas where both have a number; without medians."""
    columns = ["arena", *names]
    both = first.select(columns).join(second.select(columns), on="arena", suffix=SECOND).sort("arena")
    found = {}
    for name in names:
        there = both.drop_nulls([name, f"{name}{SECOND}"])
        values = [there[column].to_numpy() for column in (name, f"{name}{SECOND}")]
        differences = without_rounding(*values)
        mean = mean_estimate(differences, seed=seed, resamples=resamples, level=level)
        found[name] = paired_metric(differences, mean, NOTHING, level)
    return found


def without_rounding(first: Float[np.ndarray, "n"], second: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
    """Differences, first minus second, with those within rounding set to zero."""
    differences = first - second
    return np.where(np.abs(differences) <= ROUNDING * np.maximum(np.abs(first), np.abs(second)), 0.0, differences)


P = TypeVar("P")


def corrected_metrics(pairs: Sequence[P]) -> tuple[P, ...]:
    """Pairs with Holm's p-values for their metrics, with one correction for each kind of stratum."""
    result = list(pairs)
    for kind in dict.fromkeys(pair.stratum.kind for pair in pairs):
        table = [(k, name) for k, pair in enumerate(pairs) if pair.stratum.kind == kind for name in pair.metrics]
        adjusted = holm([pairs[k].metrics[name].p for k, name in table])
        for (k, name), p in zip(table, adjusted, strict=True):
            metrics = result[k].metrics
            result[k] = replace(result[k], metrics=metrics | {name: replace(metrics[name], p_holm=p)})
    return tuple(result)
