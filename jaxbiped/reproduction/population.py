"""The population behind the paper's example: what crossing saved, and where it stops paying."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import ScalarFormatter

from jaxbiped.motion.grid_units import CELL
from jaxbiped.report.answer_text import DISTANCE, TIME, Measure
from jaxbiped.report.figures import canvas, style
from jaxbiped.report.grid import to_grid
from jaxbiped.report.page import Section
from jaxbiped.report.page_figures import WIDTH, Plot
from jaxbiped.report.style import own_style
from jaxbiped.report.svg import INK, inline, themed
from jaxbiped.report.sweep_figures import BETTER_UP, Panel, fill_map
from jaxbiped.report.tables import Sheet, code_sheet, pair_sheet, strategy_sheets
from jaxbiped.report.words import signed
from jaxbiped.reproduction.paper import SAVED
from jaxbiped.reproduction.savings import Population, break_even, measured_break_even
from jaxbiped.statistics.intervals import mean_and_median

BAR, PAPER = "#0072B2", "#D55E00"
BINS = 30
OUTER = 0.005  # share of outlying arenas, on each side, that would widen a histogram
WIDTHS, DETOURS = 4, 6  # of the map
FEWEST = 5  # fewest arenas in a cell of the map
EQUATION_1 = 2 * (10 - 1) / (1 + 1) * CELL  # [m] of floor cells that cost as much as two steps cost extra: 2 (C3 - C1)
COLUMNS = {"distance": ("saved_distance", SAVED[0]), "time": ("saved_time", 60 * SAVED[1])}


def population_section(population: Population, measure: float) -> Section:
    """One population: its pictures and tables."""
    name = f"{population.arenas:,} random bumps, executor {population.executor}, sensor {population.sensor}"
    plots = () if population.both.is_empty() else drawn(population, measure)
    comparison = population.comparison
    sheets = [*strategy_sheets(comparison), pair_sheet(comparison), code_sheet(comparison)]
    return Section(name, tuple(sentences(population, measure)), plots, tuple(to_grid(each) for each in sheets))


def drawn(population: Population, measure: float) -> tuple[Plot, ...]:
    """The figures of one population with arenas that both solved."""
    plots = []

    def add(name: str, figure: Figure, caption: str) -> None:
        plots.append(Plot(inline(figure, f"{name}-{population.executor}", caption), caption))

    with themed():
        for kind in (DISTANCE, TIME):
            figure, ax = canvas(WIDTH, 3.2)
            histogram(ax, population, kind)
            caption = f"Saved {kind.name} by crossing bumps, on {len(population.both):,} arenas that both solved. "
            caption += f"The outermost bars include the {100 * OUTER:g} % farther out on each side."
            add(f"saved-{kind.name}", figure, caption)
        figure = Figure(figsize=(WIDTH, 3.6), layout="constrained")
        pay_map(figure.subplots(), population, measure)
        caption = (
            f"Median minutes saved{'' if population.always is None else ' if it is always crossed'}, by the width "
            "of the bump along the path and the detour around it. Framed: the interval excludes zero. Line: where two "
            f"steps take as long as the detour by Table 2 alone, {centimetres(break_even(measure))}."
        )
        add("pays", figure, caption)
    return tuple(plots)


def centimetres(metres: float) -> str:
    """A length as text."""
    return f"{100 * metres:.0f} cm"


def sentences(population: Population, measure: float) -> list[str]:
    """The population compared to the paper's example."""
    both, pair = population.both, population.pair
    if both.is_empty():
        return ["No arena was solved by both."]
    said = []
    places = {name: 100 * population.percentile(*COLUMNS[name]) for name in COLUMNS}
    said.append(
        f"The paper's own case saved {100 * SAVED[0]:.0f} cm and {SAVED[1]:.1f} min. Of {len(both):,} arenas that both "
        f"strategies solved, that is the {ordinal(places['distance'])} percentile of the saved distance and the "
        f"{ordinal(places['time'])} of the saved time."
    )
    crosses, saved = both["crosses"].to_numpy(), both["saved_time"].to_numpy() / 60
    said.append(
        f"With perfect knowledge, crossing the bump is cheaper, by Eq. (1), on {100 * crosses.mean():.0f} % "
        f"of them; there crossing saved {mean(saved[crosses])} min on average, elsewhere {mean(saved[~crosses])}. "
        f"Only {pair.first} reached the goal on {pair.first_only:,} arenas, only {pair.second} on {pair.second_only:,}."
    )
    even = measured_break_even(population.tried)
    if even:
        who = "of a robot that always crosses (C3 = C1)" if population.always is not None else "where it crosses"
        said.append(
            f"Saved time increases with the detour: a plane fitted to the times {who} is zero at a detour of "
            f"{centimetres(even.detour)} [{100 * even.low:.0f}, {100 * even.high:.0f}] for a bump "
            f"{centimetres(even.width)} wide ({even.arenas:,} arenas). Below that, crossing does not pay. Table 2 "
            f"alone, with two steps and a measurement in each cell, gives {centimetres(break_even(measure))}; Eq. (1) "
            f"crosses from {centimetres(EQUATION_1)} on."
        )
    return said


def mean(values: np.ndarray) -> str:
    """A mean as text."""
    return signed(float(values.mean()), 1) if len(values) else "nothing"


def ordinal(value: float) -> str:
    """As in "71st"; with a decimal where a whole number would mean none or all."""
    text = f"{value:.0f}" if 1 <= value <= 99 else f"{value:.1f}".removesuffix(".0")
    if "." in text or text[-2:] in ("11", "12", "13"):
        return f"{text}th"
    return text + {"1": "st", "2": "nd", "3": "rd"}.get(text[-1], "th")


@own_style()
def population_figure(population: Population, measure: float) -> Figure:
    """Both histograms and the map side by side."""
    figure = Figure(figsize=(2.6 * WIDTH, 3.6), layout="constrained")
    first, second, third = figure.subplots(1, 3)
    for ax, kind in ((first, DISTANCE), (second, TIME)):
        style(ax, "y")
        histogram(ax, population, kind)
    pay_map(third, population, measure)
    third.set_title("minutes saved" if population.always is None else "minutes saved by always crossing", fontsize=10)
    return figure


def histogram(ax: Axes, population: Population, kind: Measure) -> None:
    """Arenas by what they saved, with the paper's case."""
    column, paper = COLUMNS[kind.name]
    saved = population.both[column].to_numpy() * kind.scale
    low, high = np.quantile(saved, [OUTER, 1 - OUTER])
    shown = np.array([min(low, 0.0), max(high, paper * kind.scale)])
    ax.hist(np.clip(saved, *shown), bins=np.linspace(*shown + np.array([-1e-6, 1e-6]), BINS + 1), color=BAR)
    ax.axvline(0, color=INK, lw=1)
    ax.axvline(paper * kind.scale, color=PAPER, lw=2)
    place = ordinal(100 * population.percentile(column, paper))
    ax.annotate(
        f"the paper: {paper * kind.scale:.{0 if kind is DISTANCE else 1}f} {kind.unit},\n{place} percentile",
        (paper * kind.scale, 0.97), (6, 0), xycoords=("data", "axes fraction"), textcoords="offset points", va="top",
        color=PAPER, fontsize=9,
    )  # fmt: skip
    ax.set_yscale("symlog", linthresh=10)
    ax.yaxis.set_major_formatter(ScalarFormatter())
    ax.set_xlabel(f"saved {kind.name} [{kind.unit}]")
    ax.set_ylabel("arenas")


def edges(values: np.ndarray, count: int) -> np.ndarray:
    """Borders of bins of equal width."""
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)
    return np.linspace(low, high if high > low else low + 1.0, count + 1)


def pay_map(ax: Axes, population: Population, measure: float) -> None:
    """Median saved time over width and detour: a mean would be dominated by a few missions that wander."""
    both = population.tried
    width, detour, saved = (both[name].to_numpy() for name in ("width", "detour", "saved_time"))
    across, along = edges(width, WIDTHS), edges(detour, DETOURS)
    values, shown = np.full((DETOURS, WIDTHS), np.nan), np.zeros((DETOURS, WIDTHS), bool)
    column, row = (np.clip(np.digitize(v, e) - 1, 0, n - 1) for v, e, n in
                   ((width, across, WIDTHS), (detour, along, DETOURS)))  # fmt: skip
    for i, j in np.ndindex(values.shape):
        inside = saved[(row == i) & (column == j)] / 60
        if len(inside) >= FEWEST:
            _, estimate = mean_and_median(inside, seed=0, resamples=999)
            values[i, j] = round(estimate.estimate, 1) + 0.0  # avoids negative zeros
            shown[i, j] = estimate.low is not None and not estimate.low <= 0 <= estimate.high
    fill_map(ax, values, shown, Panel("", 1.0, 1, True, BETTER_UP))
    ticks(ax, across, along)
    place = (break_even(measure) - along[0]) / (along[1] - along[0]) - 0.5
    if -0.5 < place < DETOURS - 0.5:
        ax.axhline(place, color=PAPER, lw=2, ls="--")


def ticks(ax: Axes, across: np.ndarray, along: np.ndarray) -> None:
    """Borders of the cells, in centimetres."""
    ax.set_xticks(np.arange(len(across)) - 0.5, [f"{100 * x:.0f}" for x in across])
    ax.set_yticks(np.arange(len(along)) - 0.5, [f"{100 * y:.0f}" for y in along])
    ax.set_xlabel("width of the bump [cm]")
    ax.set_ylabel("detour around it [cm]")


def saved_sheet(populations: tuple[Population, ...]) -> Sheet:
    """What crossing saved in each population, with the percentile of the paper's case."""
    rows = []
    for each in populations:
        for kind in (DISTANCE, TIME):
            column, paper = COLUMNS[kind.name]
            saved = each.both[column].to_numpy() * kind.scale
            if not len(saved):
                continue
            estimate, _ = mean_and_median(saved, seed=0)
            cells = [f"{kind.name}, {kind.unit}: {each.executor}", str(len(saved))]
            limits = f" [{estimate.low:.1f}, {estimate.high:.1f}]" if estimate.low is not None else ""
            cells.append(f"{estimate.estimate:.1f}{limits}")
            cells += [f"{np.quantile(saved, q):.1f}" for q in (0.05, 0.5, 0.95)]
            cells += [f"{100 * np.mean(saved > 0):.0f}", f"{paper * kind.scale:.{0 if kind is DISTANCE else 1}f}"]
            rows.append((*cells, f"{100 * each.percentile(column, paper):.1f}"))
    columns = ("saved", "arenas", "mean", "5 %", "median", "95 %", "above 0\n%", "paper", "its percentile")
    notes = ("On arenas that both solved; BCa bootstrap intervals of the mean.",)
    return Sheet("What crossing saved", columns, (tuple(rows),), notes)
