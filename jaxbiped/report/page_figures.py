"""Figures of the HTML page: each as narrow as a phone screen, so that they lie side by side on anything wider."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl
from matplotlib.figure import Figure

from jaxbiped.report.answer_text import MEASURES, Measure, part, verdict
from jaxbiped.report.figures import CODE_COLOURS, canvas, difficulty, forest_row, legend_above, look, times
from jaxbiped.report.measures import metric_measures
from jaxbiped.report.svg import INK, LINE, inline, themed
from jaxbiped.report.tables import Sheet
from jaxbiped.report.words import OPEN
from jaxbiped.statistics import ALL, CODES, Comparison
from jaxbiped.statistics.schema import ordered_families

WIDTH = 5.2  # [inch]
NO_PLAN = "#BFC6CE"
UNPLANNED = "no plan exists"
ON_PALE, ON_COLOUR = "#222222", "#FEFEFE"  # text on a bar, the same in dark mode


@dataclass(frozen=True)
class Plot:
    """A figure as placed on the page."""

    markup: str  # of an svg or img element
    caption: str


def plots(frame: pl.DataFrame, comparison: Comparison) -> dict[str, list[Plot]]:
    """The figures that the rows have data for, by the section of the page they belong to.

    Args:
      frame: the rows that `comparison` was made from.
    """
    result = {"strategies": [], "pair": [], "strata": [], "failures": []}

    def add(section: str, name: str, figure: Figure, caption: str) -> None:
        result[section].append(Plot(inline(figure, name, caption), caption))

    with themed():
        add("strategies", "rates", rates(comparison), "Reached the goal, with Wilson intervals.")
        caption = "Success against difficulty, in fifths of the arenas, with Wilson intervals."
        add("strategies", "difficulty", difficulty(frame, comparison, (WIDTH, 3.6)), caption)
        if comparison.question:
            first, second = comparison.question
            for measure in (*MEASURES, *metric_measures(comparison)):
                caption = (
                    f"Difference in {measure.name}, {first} minus {second}, with its interval. Filled: shown after "
                )
                caption += "Holm’s correction. Cross: too few arenas, or too similar, for an interval."
                add("strata", f"forest-{measure.name}", forest(comparison, first, second, measure), caption)
            caption = "Time on each arena that both solved."
            add("pair", "times", times(frame, first, second, (WIDTH, WIDTH)), caption)
        caption = "How missions ended: those without a plan would also fail with perfect knowledge of the arena. "
        caption += "The other failures come from sensing, from planning on what was sensed, or from walking."
        add("failures", "attribution", attribution(frame, comparison), caption)
    return result


def rates(comparison: Comparison) -> Figure:
    """A row for each strategy: its success with its interval."""
    names = comparison.strategies
    figure, ax = canvas(WIDTH, 1.0 + 0.38 * len(names), grid="x")
    for y, name in enumerate(names):
        rate = comparison.summary(name).success
        colour, mark = look(name, names)
        if rate.valid:
            ax.plot([100 * rate.low, 100 * rate.high], [y, y], color=colour, lw=2, solid_capstyle="butt")
            ax.plot(100 * rate.estimate, y, mark, color=colour, ms=7)
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(names) - 0.5, -0.5)
    ax.set_xlim(-2, 102)
    ax.set_xlabel("reached the goal [%]")
    ax.tick_params(axis="y", length=0)
    return figure


def forest(comparison: Comparison, first: str, second: str, measure: Measure) -> Figure:
    """One measure: over all arenas, then each family, then each third of difficulty."""
    groups = [(ALL,), *(comparison.strata(kind) for kind in ("family", "difficulty"))]
    groups = [group for group in groups if group]
    count = sum(len(group) for group in groups)
    figure, ax = canvas(WIDTH, 1.2 + 0.3 * count, grid="x")
    ax.axvline(0, color=INK, lw=1)
    y, names = 0, []
    for group in groups:
        for stratum in group:
            pair = comparison.pair(first, second, stratum)
            shown = verdict(pair, measure) != OPEN
            forest_row(ax, y, part(pair, measure)[0], measure, stratum, shown)
            names.append(stratum.name if stratum.kind != "difficulty" else f"difficulty {stratum.name}")
            y += 1
        if y < count:
            ax.axhline(y - 0.5, color=LINE, lw=1)
    spread = max(abs(limit) for limit in ax.get_xlim())
    ax.set_xlim(-spread, spread)
    ax.set_yticks(range(count), names)
    ax.set_ylim(count - 0.4, -0.6)
    if measure.smaller_is_better is not None:
        left, right = (first, second) if measure.smaller_is_better else (second, first)
        ax.set_xlabel(f"← {left} better\u2003\u2003{right} better →")
    ax.set_title(f"{measure.name} [{measure.unit}]" if measure.unit else measure.name)
    ax.tick_params(axis="y", length=0)
    return figure


def attribution(frame: pl.DataFrame, comparison: Comparison) -> Figure:
    """Stacked bars, one per strategy: reached, without a plan, and how the others were lost."""
    names = comparison.strategies
    figure, ax = canvas(WIDTH, 1.5 + 0.4 * len(names), grid="x")
    left = np.zeros(len(names))
    for label, counts in attributed(frame, names).items():
        values = 100 * counts / np.maximum([comparison.summary(name).n for name in names], 1)
        if not values.any():
            continue
        colour = NO_PLAN if label == UNPLANNED else CODE_COLOURS[label]
        ax.barh(range(len(names)), values, left=left, color=colour, label=label.replace("_", " "), height=0.66)
        for y, (value, start) in enumerate(zip(values, left, strict=True)):
            if value >= 5:
                ink = ON_PALE if label in ("reached", UNPLANNED, "no_path", "out_of_steps") else ON_COLOUR
                ax.text(start + value / 2, y, f"{value:.0f}", ha="center", va="center", color=ink, fontsize=8)
        left += values
    ax.set_yticks(range(len(names)), names)
    ax.invert_yaxis()
    ax.set_xlim(0, 100)
    ax.set_xlabel("missions [%]")
    ax.tick_params(axis="y", length=0)
    legend_above(figure, ax, columns=4)
    return figure


def attributed(frame: pl.DataFrame, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Numbers of missions of each strategy by how they ended; together they are all missions."""
    wheres = {"reached": pl.col("success"), UNPLANNED: ~pl.col("success") & ~pl.col("reachable")}
    wheres |= {code: pl.col("reachable") & (pl.col("code") == code) for code in CODES[1:]}
    sides = [frame.filter(pl.col("strategy") == name) for name in names]
    return {label: np.array([side.select(where.sum()).item() for side in sides]) for label, where in wheres.items()}


def attribution_sheet(frame: pl.DataFrame, first: str, second: str) -> Sheet:
    """The same for two strategies, family by family."""
    parts = [(family, frame.filter(pl.col("family") == family)) for family in ordered_families(frame["family"])]
    counts = {family: attributed(rows, (first, second)) for family, rows in parts if len(rows)}
    seen = [label for label in ("reached", UNPLANNED, *CODES[1:]) if any(item[label].any() for item in counts.values())]
    groups = tuple(
        (
            (name, *[""] * len(seen)),
            *((family, *(str(item[label][k]) for label in seen)) for family, item in counts.items()),
        )
        for k, name in enumerate((first, second))
    )
    notes = (f"Counts. “{UNPLANNED.capitalize()}”: none for this strategy with perfect knowledge, however it ended.",)
    return Sheet(
        "How missions ended, by family", ("family", *(label.replace("_", " ") for label in seen)), groups, notes
    )
