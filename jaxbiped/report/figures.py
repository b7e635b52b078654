"""Figures of a comparison, as matplotlib figures that need no window system."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jaxbiped.files import write_whole
from jaxbiped.report.answer_text import MEASURES, SUCCESS, Measure, part, verdict
from jaxbiped.report.style import own_style
from jaxbiped.report.words import OPEN
from jaxbiped.statistics import ALL, CODES, Comparison, Estimate, Stratum, proportion

# Okabe and Ito's colours, which colour-blind people can distinguish: one for each strategy, in every figure.
COLOURS = {
    "full": "#0072B2",
    "bump_aware": "#009E73",
    "gate_aware": "#CC79A7",
    "floor_only": "#E69F00",
    "blind_stop": "#7F7F7F",
}
MARKERS = {"full": "o", "bump_aware": "s", "gate_aware": "^", "floor_only": "D", "blind_stop": "v"}
CODE_COLOURS = {
    "reached": "#D9E6DC",
    "no_path": "#56B4E9",
    "stuck": "#0072B2",
    "collided": "#D55E00",
    "fell": "#8E1F1C",
    "out_of_bounds": "#CC79A7",
    "out_of_steps": "#F0C53A",
    "invalid": "#000000",
    "planner_failed": "#5D3A9B",
    "planner_timeout": "#A98BD0",
}
OWN_COLOURS = ("#D55E00", "#56B4E9", "#8E1F1C", "#5D3A9B", "#B0A000", "#000000")  # for users' own strategies
FAMILY_COLOURS = ("#0072B2", "#D55E00", "#E69F00", "#CC79A7", "#009E73", "#56B4E9", "#7F7F7F")
INK, GRID = "#333333", "#DDDDDD"
BINS = 5  # of difficulty
DPI = 160


@own_style()
def write_figures(folder: str | Path, frame: pl.DataFrame, comparison: Comparison) -> dict[str, str]:
    """Write the figures that the rows have data for as PNGs into `folder`; file name to caption, in order.

    Args:
      folder: an existing folder.
      frame: the rows that `comparison` was made from.
    """
    frame = frame.filter(pl.col("point") == comparison.point)
    figures: dict[str, tuple[Figure, str]] = {
        "success.png": (success(comparison), "Success of each strategy by family, with Wilson intervals."),
        "codes.png": (codes(comparison), "How the missions of each strategy ended."),
        "difficulty.png": (difficulty(frame, comparison), "Success against difficulty, with Wilson intervals."),
    }
    if comparison.question:
        first, second = comparison.question
        caption = f"{first} minus {second} on the same arenas: success, and mean distance and time where both solved. "
        caption += (
            "Filled: a difference is shown after Holm's correction. Cross: too few or too similar for an interval."
        )
        figures["differences.png"] = (differences(comparison, first, second), caption)
        caption = f"Time of {first} against {second} on arenas that both solved."
        figures["times.png"] = (times(frame, first, second), caption)
    for name, (figure, _) in figures.items():
        write_whole(Path(folder) / name, saver(figure))
    return {name: caption for name, (_, caption) in figures.items()}


def saver(figure: Figure) -> Callable[[object], None]:
    """A function that writes a figure to an open file; the same figure gives the same bytes."""

    @own_style()
    def save(file: object) -> None:
        figure.savefig(file, format="png", dpi=DPI, metadata={"Software": None})

    return save


@own_style()
def success(comparison: Comparison) -> Figure:
    """Dots with intervals: families along x, strategies side by side."""
    strata = (ALL, *comparison.strata("family"))
    figure, ax = canvas(8.4, 4.2)
    for offset, strategy in zip(dodge(len(comparison.strategies), 0.64), comparison.strategies, strict=True):
        found = [(x, comparison.summary(strategy, stratum)) for x, stratum in enumerate(strata)]
        points = [(x + offset, item.success) for x, item in found if item and item.success.valid]
        error_bars(ax, points, strategy, look(strategy, comparison.strategies), 100.0)
    for x in range(0, len(strata), 2):
        ax.axvspan(x - 0.5, x + 0.5, color="#F6F6F6", zorder=0, lw=0)
    sizes = [max(item.n for item in comparison.summaries if item.stratum == stratum) for stratum in strata]
    ax.set_xticks(range(len(strata)), [f"{s.name}\nn = {n}" for s, n in zip(strata, sizes, strict=True)])
    ax.set_xlim(-0.5, len(strata) - 0.5)
    ax.set_ylim(-2, 102)
    ax.set_ylabel("reached the goal [%]")
    ax.tick_params(axis="x", length=0)
    legend_above(figure, ax)
    return figure


@own_style()
def codes(comparison: Comparison) -> Figure:
    """Stacked bars, one per strategy: the shares of how its missions ended."""
    names = comparison.strategies
    figure, ax = canvas(8.4, 0.8 + 0.5 * len(names), grid="x")
    summaries = [comparison.summary(name) for name in names]
    left = np.zeros(len(names))
    for index, code in enumerate(CODES):
        shares = np.array([100 * item.codes[index] / max(item.n, 1) for item in summaries])
        if not shares.any():
            continue
        label, colour = code.replace("_", " "), CODE_COLOURS[code]
        ax.barh(range(len(names)), shares, left=left, color=colour, label=label, height=0.66, edgecolor="white")
        for y, (share, start) in enumerate(zip(shares, left, strict=True)):
            if share >= 4:
                ink = INK if code in ("reached", "no_path", "out_of_steps", "out_of_bounds") else "white"
                ax.text(start + share / 2, y, f"{share:.0f}", ha="center", va="center", color=ink, fontsize=8)
        left += shares
    ax.set_yticks(range(len(names)), names)
    ax.invert_yaxis()
    ax.set_xlim(0, 100)
    ax.set_xlabel("missions [%]")
    ax.tick_params(axis="y", length=0)
    legend_above(figure, ax, columns=8)
    return figure


@own_style()
def differences(comparison: Comparison, first: str, second: str) -> Figure:
    """A forest plot: success, distance and time, over all arenas and by family."""
    strata = (ALL, *comparison.strata("family"))
    figure = Figure(figsize=(9.2, 1.3 + 0.4 * len(strata)), layout="constrained")
    axes = figure.subplots(1, len(MEASURES), sharey=True)
    for ax, measure in zip(axes, MEASURES, strict=True):
        style(ax, "x")
        ax.axvline(0, color=INK, lw=1)
        for y, stratum in enumerate(strata):
            pair = comparison.pair(first, second, stratum)
            shown = verdict(pair, measure) != OPEN
            forest_row(ax, y, part(pair, measure)[0], measure, stratum, shown)
        ax.axhline(0.5, color=GRID, lw=1)
        ax.set_title(f"{measure.name} [{measure.unit}]", fontsize=10)
        spread = max(abs(limit) for limit in ax.get_xlim())
        ax.set_xlim(-spread, spread)
        left, right = (second, first) if measure is SUCCESS else (first, second)
        ax.set_xlabel(f"← {left} better    {right} better →", fontsize=8)
        ax.tick_params(axis="y", length=0)
    axes[0].set_yticks(range(len(strata)), [stratum.name for stratum in strata])
    axes[0].set_ylim(len(strata) - 0.4, -0.6)
    figure.suptitle(f"{first} minus {second} on the same arenas, with intervals", fontsize=10)
    return figure


def forest_row(ax: Axes, y: int, value: Estimate, measure: Measure, stratum: Stratum, shown: bool) -> None:
    """One estimate with its interval; a cross if there is no interval, words if there is no estimate."""
    if not value.valid:
        ax.annotate("none solved by both", (0, y), ha="center", va="center", fontsize=7, color=INK, backgroundcolor="w")
        return
    x = value.estimate * measure.scale
    if value.low is None:
        ax.plot(x, y, "x", color=INK, ms=6)
        return
    colour = COLOURS["full"] if shown else "#888888"
    ax.plot([value.low * measure.scale, value.high * measure.scale], [y, y], color=colour, lw=2, solid_capstyle="butt")
    face = colour if shown else "white"
    ax.plot(x, y, "D" if stratum == ALL else "o", color=colour, mfc=face, ms=7, mew=1.6)


@own_style()
def times(frame: pl.DataFrame, first: str, second: str, size: tuple[float, float] = (5.6, 5.4)) -> Figure:
    """A dot for each arena that both solved: below the diagonal, the first is faster."""
    sides = [frame.filter((pl.col("strategy") == name) & pl.col("success")) for name in (first, second)]
    both = sides[0].join(sides[1].select("arena", "time"), on="arena", suffix="_second")
    figure, ax = canvas(*size, grid="both")
    families = list(dict.fromkeys(frame["family"]))
    for colour, family in zip(FAMILY_COLOURS, families, strict=False):
        rows = both.filter(pl.col("family") == family)
        if len(rows):
            x, y = rows["time_second"].to_numpy() / 60, rows["time"].to_numpy() / 60
            ax.plot(x, y, "o", color=colour, ms=4.5, alpha=0.65, mew=0, label=f"{family} ({len(rows)})")
    if len(both):
        values = np.concatenate([both["time"].to_numpy(), both["time_second"].to_numpy()]) / 60
        margin = 0.04 * np.ptp(values) + 0.1
        limits = (max(0.0, values.min() - margin), values.max() + margin)
        ax.plot(limits, limits, color=INK, lw=1)
        ax.set_xlim(limits)
        ax.set_ylim(limits)
        ax.text(0.97, 0.03, f"{first} faster", transform=ax.transAxes, ha="right", color=INK)
        ax.text(0.03, 0.97, f"{second} faster", transform=ax.transAxes, va="top", color=INK)
        legend_above(figure, ax, columns=3)
    else:
        ax.text(0.5, 0.5, "no arena was solved by both", transform=ax.transAxes, ha="center")
    ax.set_aspect("equal")
    ax.set_xlabel(f"time of {second} [min]")
    ax.set_ylabel(f"time of {first} [min]")
    return figure


@own_style()
def difficulty(frame: pl.DataFrame, comparison: Comparison, size: tuple[float, float] = (6.4, 4.2)) -> Figure:
    """Success in fifths of the arenas by difficulty, at the fifth's mean difficulty."""
    arenas = frame.unique("arena")["difficulty"].to_numpy()
    edges = np.unique(np.quantile(arenas, np.linspace(0, 1, BINS + 1)[1:-1], method="lower"))
    figure, ax = canvas(*size)
    width = 0.25 * float(np.ptp(arenas)) / BINS
    for offset, strategy in zip(dodge(len(comparison.strategies), width), comparison.strategies, strict=True):
        rows = frame.filter(pl.col("strategy") == strategy)
        values, reached = rows["difficulty"].to_numpy(), rows["success"].to_numpy()
        bins = np.searchsorted(edges, values, side="left")
        points = []
        for index in np.unique(bins):
            inside = bins == index
            rate = proportion(int(reached[inside].sum()), int(inside.sum()), comparison.level)
            points.append((float(values[inside].mean()) + offset, rate))
        error_bars(ax, points, strategy, look(strategy, comparison.strategies), 100.0, line=True)
    ax.set_ylim(-2, 102)
    ax.set_xlabel("difficulty of the arena (0 easy, 1 hard)")
    ax.set_ylabel("reached the goal [%]")
    legend_above(figure, ax, columns=3)
    return figure


def look(name: str, names: Sequence[str]) -> tuple[str, str]:
    """Colour and marker of one of `names`: a strategy's own, else by its position among them."""
    if name in COLOURS:
        return COLOURS[name], MARKERS[name]
    if set(names) & set(COLOURS):  # beside built-in ones
        place = [other for other in names if other not in COLOURS].index(name) % len(OWN_COLOURS)
        return OWN_COLOURS[place], "P*Xdph"[place]
    place = names.index(name) % len(FAMILY_COLOURS)
    return FAMILY_COLOURS[place], "osD^vP*"[place]


def error_bars(
    ax: Axes, points: list[tuple[float, Estimate]], name: str, look: tuple[str, str], scale: float, line: bool = False
) -> None:
    """Dots with intervals in a colour and mark."""
    if not points:
        return
    x = [at for at, _ in points]
    y = np.array([value.estimate for _, value in points]) * scale
    low, high = (np.array([getattr(value, end) for _, value in points]) * scale for end in ("low", "high"))
    bars = np.maximum(0, [y - low, high - y])
    style = {"color": look[0], "fmt": look[1] + ("-" if line else ""), "label": name}
    ax.errorbar(x, y, yerr=bars, ms=5.5, lw=1.4, elinewidth=1.4, capsize=2.5, **style)


def dodge(count: int, width: float) -> np.ndarray:
    """Offsets side by side within `width`, centred."""
    return (np.arange(count) - (count - 1) / 2) * width / max(count - 1, 1)


def canvas(width: float, height: float, grid: str = "y") -> tuple[Figure, Axes]:
    """A figure [inch] with one plain pair of axes."""
    figure = Figure(figsize=(width, height), layout="constrained")
    ax = figure.subplots()
    style(ax, grid)
    return figure, ax


def style(ax: Axes, grid: str) -> None:
    """Light grid lines behind the data, no frame above and to the right."""
    ax.grid(axis=grid, color=GRID, lw=0.7)
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)


def legend_above(figure: Figure, ax: Axes, columns: int = 5) -> None:
    """A legend that hides no data."""
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside upper center", ncols=min(columns, len(labels)), frameon=False, fontsize=9
    )
