"""Metrics beside success, distance and time: their means, and differences on the same arenas."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
import polars as pl

from jaxbiped.study.intervals import NOTHING, Estimate, mean_estimate
from jaxbiped.study.paired import PairedMetric, holm, improvement, signed_rank

SECOND = "#second"  # after a column of the second side: no name of a column ends so
DIGITS = 6  # after the point: what agrees within these is a tie; sums of floats in another order differ by less


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
    """Differences (first minus second) of each column on the arenas where both have a number; medians are left out."""
    columns = ["arena", *names]
    both = first.select(columns).join(second.select(columns), on="arena", suffix=SECOND).sort("arena")
    found = {}
    for name in names:
        there = both.drop_nulls([name, f"{name}{SECOND}"])
        differences = np.round(there[name].to_numpy() - there[f"{name}{SECOND}"].to_numpy(), DIGITS)
        found[name] = PairedMetric(
            mean=mean_estimate(differences, seed=seed, resamples=resamples, level=level),
            median=NOTHING,
            improvement=improvement(differences, level),
            p=signed_rank(differences),
            p_holm=None,
            n=len(differences),
            zeros=int(np.sum(differences == 0)),
        )
    return found


P = TypeVar("P")


def corrected_metrics(pairs: Sequence[P]) -> tuple[P, ...]:
    """Pairs with Holm's p-values for their metrics: one correction for each kind of stratum."""
    result = list(pairs)
    for kind in dict.fromkeys(pair.stratum.kind for pair in pairs):
        table = [(k, name) for k, pair in enumerate(pairs) if pair.stratum.kind == kind for name in pair.metrics]
        adjusted = holm([pairs[k].metrics[name].p for k, name in table])
        for (k, name), p in zip(table, adjusted, strict=True):
            metrics = result[k].metrics
            result[k] = replace(result[k], metrics=metrics | {name: replace(metrics[name], p_holm=p)})
    return tuple(result)
