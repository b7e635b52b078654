"""Each strategy's own metric with intervals: over the values of one swept field, or strategies side by side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import polars as pl
from matplotlib.figure import Figure

from jaxbiped.mission.metric import MetricFormat
from jaxbiped.report.answer_text import MEASURES
from jaxbiped.report.figures import canvas, error_bars, legend_above, look
from jaxbiped.report.measures import metric_measure
from jaxbiped.report.style import own_style
from jaxbiped.report.sweep_figures import scale_x
from jaxbiped.statistics.intervals import Estimate, mean_and_median, proportion
from jaxbiped.statistics.schema import ordered

RESAMPLES = 999


def own_estimate(rows: pl.DataFrame, metric: str, seed: int = 0) -> Estimate:
    """A metric of one strategy's rows with its interval: Wilson's for a rate, BCa's for a mean over reached missions.

    Means of different strategies are over different missions: those that each of them solved.
    """
    if metric == "success":
        return proportion(int(rows["success"].sum()), len(rows))
    return mean_and_median(rows[metric].drop_nulls().to_numpy(), seed=seed, resamples=RESAMPLES)[0]


@own_style()
def own_metric(
    rows: pl.DataFrame,
    points: pl.DataFrame,
    metric: str,
    size: tuple[float, float] = (6.4, 4.0),
    shown: Mapping[str, MetricFormat] = MappingProxyType({}),
) -> Figure:
    """The figure.

    Args:
      points: as returned by `store.read_points`, with at most one swept field.
      size: [inch] width and height.
      shown: how numbers of metrics are displayed, from the manifest.
    """
    measure = next((item for item in MEASURES if item.name == metric), None) or metric_measure(metric, shown)
    strategies, fields = ordered(rows["strategy"].unique()), [name for name in points.columns if name != "point"]
    figure, ax = canvas(*size)
    places = points[fields[0]].to_numpy() if fields else np.zeros(1)
    shifts = np.zeros(len(strategies)) if fields else np.arange(len(strategies))
    for shift, name in zip(shifts, strategies, strict=True):
        found = []
        for place, point in zip(places, points["point"], strict=True):
            value = own_estimate(rows.filter((pl.col("strategy") == name) & (pl.col("point") == point)), metric)
            if value.valid and value.low is None:  # too few or too similar for an interval
                value = replace(value, low=value.estimate, high=value.estimate)
            if value.valid:
                found.append((float(place + shift), value))
        error_bars(
            ax, sorted(found, key=lambda item: item[0]), name, look(name, strategies), measure.scale, bool(fields)
        )
    if fields:
        scale_x(ax, list(map(float, places)))
        ax.set_xlabel(fields[0])
        legend_above(figure, ax, columns=3)
    else:
        ax.set_xticks(range(len(strategies)), strategies, rotation=20 if len(strategies) > 4 else 0)
        ax.set_xlim(-0.5, len(strategies) - 0.5)
    unit, where = f" [{measure.unit}]" if measure.unit else "", " where reached" if measure in MEASURES else ""
    ax.set_ylabel("reached the goal [%]" if metric == "success" else f"mean {measure.name}{where}{unit}")
    return figure
