"""Figures of a sweep: a line over one axis, a heat map over two, otherwise dots over each field."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from jaxbiped.report.answer_text import MEASURES, SUCCESS, TIME, Measure, part
from jaxbiped.report.figures import INK, error_bars, legend_above, look, style
from jaxbiped.report.style import own_style
from jaxbiped.statistics import Estimate
from jaxbiped.statistics.sweep_points import PointResult, SweepResult

RATIO = 8.0  # ratio of greatest to least value above which an axis is logarithmic
BETTER_UP, BETTER_DOWN = "RdBu", "RdBu_r"  # around zero: blue where the first strategy is better
RISING = "Blues"
DARK, PALE = "#222222", "#FEFEFE"  # text on colours, which stay the same in dark mode
PALER = 1.3  # by this factor the greatest difference is paler than the darkest colour


@dataclass(frozen=True)
class Panel:
    """One quantity of a sweep, with an estimate for each point."""

    title: str
    scale: float
    digits: int
    signed: bool  # a difference, read against zero
    colours: str

    def of(self, point: PointResult) -> Estimate | None:
        raise NotImplementedError


@dataclass(frozen=True)
class Rate(Panel):
    """Success of a strategy."""

    strategy: str = ""

    def of(self, point: PointResult) -> Estimate | None:
        return point.success.get(self.strategy)


@dataclass(frozen=True)
class Difference(Panel):
    """The question's pair, in one measure."""

    measure: Measure = SUCCESS

    def of(self, point: PointResult) -> Estimate | None:
        return part(point.pair, self.measure)[0] if point.pair else None


def difference_panels(result: SweepResult, measures: Sequence[Measure] = MEASURES) -> list[Panel]:
    """The question's pair, with a panel for each measure."""
    if result.question is None:
        return []
    first, second = result.question
    return [
        Difference(
            f"{first} minus {second}:\n{m.name} [{m.unit}]",
            m.scale,
            m.digits,
            True,
            BETTER_DOWN if m.smaller_is_better else BETTER_UP,
            m,
        )
        for m in measures
    ]


def rate_panels(result: SweepResult) -> list[Panel]:
    """Success, with a panel for each strategy."""
    return [Rate(f"{name}:\nsuccess [%]", 100.0, 0, False, RISING, name) for name in result.strategies]


def sweep_figure(result: SweepResult, axes: Sequence[str]) -> tuple[Figure, str]:
    """The figure that fits a sweep, and its caption.

    Args:
      axes: the field of each axis; empty if the points lie on no grid.
    """
    if len(axes) == 1:
        return line(result, axes[0]), f"Against {axes[0]}, with intervals at {100 * result.level:g} %."
    if len(axes) == 2:
        caption = "Success of each strategy."
        if result.question:
            caption = f"Blue: {result.question[0]} is better. Framed: the interval excludes zero."
        return heat_map(result, *axes), caption
    return dots(result), "Each dot is a sweep point, drawn over each of the swept fields."


@own_style()
def line(result: SweepResult, field: str) -> Figure:
    """Success of each strategy, and the differences of the question's pair, against one field."""
    panels = difference_panels(result)
    figure = Figure(figsize=(3.4 * (1 + len(panels)), 3.6), layout="constrained")
    first, *others = np.atleast_1d(figure.subplots(1, 1 + len(panels)))
    style(first, "y")
    for name in result.strategies:
        found = [(point.values[field], point.success[name]) for point in result.points if name in point.success]
        error_bars(first, found, name, look(name, result.strategies), 100.0, line=True)
    first.set_ylabel("reached the goal [%]")
    for ax, panel in zip(others, panels, strict=True):
        style(ax, "y")
        ax.axhline(0, color=INK, lw=1)
        found = [(point.values[field], panel.of(point)) for point in result.points]
        found = [(x, value) for x, value in found if value and value.valid and value.low is not None]
        error_bars(ax, found, "", ("#444444", "o"), panel.scale, line=True)
        ax.set_title(panel.title, fontsize=9)
    for ax in (first, *others):
        scale_x(ax, [point.values[field] for point in result.points])
        ax.set_xlabel(field)
    legend_above(figure, first)
    return figure


@own_style()
def heat_map(result: SweepResult, field_y: str, field_x: str, panels: Sequence[Panel] = ()) -> Figure:
    """A map for each quantity over two axes, each cell with its number."""
    panels = panels or difference_panels(result) or rate_panels(result)
    xs, ys = (sorted({point.values[field] for point in result.points}) for field in (field_x, field_y))
    size = (len(panels) * max(2.2, 0.62 * len(xs)) + 1.2, max(2.4, 0.46 * len(ys)) + 1.2)
    figure = Figure(figsize=size, layout="constrained")
    for ax, panel in zip(np.atleast_1d(figure.subplots(1, len(panels), sharey=True)), panels, strict=True):
        values, shown = np.full((len(ys), len(xs)), np.nan), np.zeros((len(ys), len(xs)), bool)
        for point in result.points:
            value, at = panel.of(point), (ys.index(point.values[field_y]), xs.index(point.values[field_x]))
            if value and value.valid:
                values[at] = value.estimate * panel.scale
                shown[at] = panel.signed and value.low is not None and not value.low <= 0 <= value.high
        fill_map(ax, values, shown, panel)
        ax.set_xticks(range(len(xs)), [f"{x:g}" for x in rounded(xs)], fontsize=8)
        ax.set_yticks(range(len(ys)), [f"{y:g}" for y in rounded(ys)], fontsize=8)
        ax.set_xlabel(field_x)
        ax.set_title(panel.title, fontsize=9)
    figure.axes[0].set_ylabel(field_y)
    return figure


def fill_map(ax: Axes, values: np.ndarray, shown: np.ndarray, panel: Panel) -> None:
    """Draw colours and numbers of one map [rows from below]; `shown` cells are framed."""
    most = PALER * np.nanmax(np.abs(values), initial=1e-9)
    limits = {"vmin": -most, "vmax": most} if panel.signed else {"vmin": 0, "vmax": 100}
    image = ax.imshow(values, origin="lower", aspect="auto", cmap=panel.colours, **limits)
    for (i, j), value in np.ndenumerate(values):
        if not np.isfinite(value):
            ax.text(j, i, "–", ha="center", va="center", fontsize=8, color=DARK)
            continue
        red, green, blue, _ = image.cmap(image.norm(value))
        dark = 0.3 * red + 0.59 * green + 0.11 * blue < 0.5
        text = f"{value:+.{panel.digits}f}" if panel.signed else f"{value:.{panel.digits}f}"
        ax.text(j, i, text, ha="center", va="center", fontsize=7.5, color=PALE if dark else DARK)
        if shown[i, j]:
            ax.add_patch(Rectangle((j - 0.46, i - 0.46), 0.92, 0.92, fill=False, edgecolor=DARK, lw=1.2))
    ax.tick_params(length=0)


@own_style()
def dots(result: SweepResult) -> Figure:
    """A column for each field, with a row for success and one for the time of the question's pair."""
    fields, panels = result.fields, [None, *difference_panels(result, (TIME,))]
    figure = Figure(figsize=(2.6 * len(fields) + 0.6, 2.4 * len(panels) + 0.5), layout="constrained")
    grid = np.asarray(figure.subplots(len(panels), len(fields), sharey="row", squeeze=False))
    for row, panel in zip(grid, panels, strict=True):
        for ax, field in zip(row, fields, strict=True):
            style(ax, "y")
            x = [point.values[field] for point in result.points]
            if panel is None:
                for name in result.strategies:
                    colour, mark = look(name, result.strategies)
                    y = [
                        100 * point.success[name].estimate if name in point.success else np.nan
                        for point in result.points
                    ]
                    ax.plot(x, y, mark, color=colour, ms=4, alpha=0.7, mew=0, label=name)
            else:
                values = [panel.of(point) for point in result.points]
                y = [panel.scale * value.estimate if value and value.valid else np.nan for value in values]
                ax.axhline(0, color=INK, lw=1)
                ax.plot(x, y, "o", color="#444444", ms=4, alpha=0.7, mew=0)
            scale_x(ax, x)
            ax.set_xlabel(field)
        row[0].set_ylabel("reached the goal [%]" if panel is None else panel.title, fontsize=9)
    legend_above(figure, grid[0, 0])
    return figure


def scale_x(ax: Axes, values: Sequence[float]) -> None:
    """Set a log scale for values over a wide range, and ticks at the values if they are few."""
    different = sorted(set(values))
    if different[0] > 0 and different[-1] / different[0] >= RATIO:
        ax.set_xscale("log")
    if len(different) <= 9:
        ax.set_xticks(different, [f"{x:g}" for x in rounded(different)], fontsize=8)
        ax.minorticks_off()


def rounded(values: Sequence[float]) -> list[float]:
    """Values rounded to three digits."""
    return [float(f"{value:.3g}") for value in values]
