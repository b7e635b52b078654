"""Tables, picture and summary of tuned costs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jaxbiped.files import write_whole
from jaxbiped.report.figures import GRID, INK, saver, style
from jaxbiped.report.style import own_style
from jaxbiped.report.tables import Sheet, to_markdown
from jaxbiped.report.words import NONE, brackets, number, percent, signed
from jaxbiped.statistics.intervals import Estimate
from jaxbiped.study.durations import Fit
from jaxbiped.study.tuning import DURATIONS, START, SWEPT, TUNED, Gap, TuneConfig, Tuning

PAPER = (1.0, 1.0, 5.0, 10.0)  # C0 to C3
COLOURS = {"c1": "#0072B2", "c2": "#CC79A7", "c3": "#D55E00", "c4": "#009E73"}
SMOOTH = 5  # steps in the running mean of the picture


def costs_sheet(tuning: Tuning, config: TuneConfig) -> Sheet:
    """The costs that were evaluated on the test arenas."""
    rows = []
    for name, costs in tuning.costs.items():
        test = tuning.test.filter(costs=name)
        reached = test.filter(code="reached")
        time = reached["elapsed"].mean()
        cells = (name, *(f"{cost:.4g}" for cost in costs), number(test["objective"].mean(), 1))
        rows.append((*cells, percent(len(reached) / len(test)), number(time and time / 60, 2)))
    return Sheet(
        f"Costs, on {config.test_arenas} test arenas",
        ("costs", "C0", "C1", "C2", "C3", "C4", "objective\ns", "reached\n%", "time\nmin"),
        (tuple(rows),),
        (
            f"Objective: the time of a mission, {config.penalty:g} s if it fails or takes longer.",
            "Time: of those that arrived, which are different arenas.",
        ),
    )


def gaps_sheet(tuning: Tuning) -> Sheet:
    """The differences on the test arenas."""
    rows = []
    for gap in tuning.gaps:
        cells = (f"{gap.first} minus {gap.second}", estimate(gap.objective), estimate(gap.success, 100.0))
        rows.append((*cells, estimate(gap.time.mean)))
    both = sorted(gap.time.n for gap in tuning.gaps)
    return Sheet(
        "Differences on the same test arenas, with 95 % intervals",
        ("costs", "objective s", "reached, points", "time s"),
        (tuple(rows),),
        (
            f"Below zero: the first is faster. Time: where both arrived, {both[0]} to {both[-1]} arenas.",
            "Intervals: BCa bootstrap, Student's t above 5,000 arenas; of success, Tango's.",
        ),
    )


def fits_sheet(fits: Mapping[str, Fit], title: str) -> Sheet:
    """The costs that durations imply."""
    rows = [("the paper's", *(f"{cost:.2f}" for cost in PAPER), "", "")]
    for name, fit in fits.items():
        off = float(np.sqrt(np.mean((fit.fitted - fit.measured) ** 2)))
        rows.append((name, *(f"{cost:.2f}" for cost in fit.costs), f"{fit.seconds:.2f}", f"{off:.1f}"))
    return Sheet(
        title,
        ("least squares over", "C0", "C1", "C2", "C3", "a unit\ns", "rms\nerror s"),
        (tuple(rows),),
        (
            "Scaled: a straight move on the floor costs 2. C4 cannot be derived from durations.",
            "Straight moves cannot separate C0 from C1: there C1 = C0, as in the paper.",
        ),
    )


def estimate(value: Estimate, scale: float = 1.0) -> str:
    """An estimate with its sign and its interval."""
    if value.estimate is None:
        return NONE
    return f"{signed(value.estimate * scale, 1)} {brackets(value, scale)}"


def costs_toml(costs: tuple[float, ...], comments: tuple[str, ...]) -> str:
    """A study file with these costs, for `jaxbiped compare`."""
    lines = [f"# {line}" for line in comments] + ["[mission.costs]"]
    return "\n".join([*lines, *(f"c{k} = {float(cost)!r}" for k, cost in enumerate(costs))]) + "\n"


def sentence(tuning: Tuning) -> str:
    """The result, whatever its sign."""
    gap = tuning.gaps[0]
    change, limits = signed(gap.objective.estimate, 1), brackets(gap.objective)
    low, high = gap.objective.low, gap.objective.high
    if low is None or (low <= 0 <= high):
        verdict = "no difference is shown"
    else:
        verdict = "they are better" if high < 0 else "they are worse"
    return f"The tuned costs change the objective by {change} s {limits} on the test arenas: {verdict}."


@own_style()
def picture(tuning: Tuning) -> Figure:
    """Costs and objective over the steps, and the result on the test arenas."""
    figure = Figure(figsize=(11.0, 3.6), layout="constrained")
    paths, gain, gaps = figure.subplots(1, 3, width_ratios=(1.1, 1, 1))
    draw_paths(paths, tuning)
    draw_gain(gain, tuning)
    draw_gaps(gaps, tuning.gaps)
    return figure


def draw_paths(ax: Axes, tuning: Tuning) -> None:
    """Draw the costs at each step; dots: the final costs."""
    style(ax, "y")
    steps = tuning.history["step"].to_numpy()
    for k, (name, colour) in enumerate(COLOURS.items(), start=1):
        start, tuned = (tuning.costs[which][k] for which in (START, TUNED))
        ax.plot(steps, tuning.history[name], color=colour, lw=1.5)
        ax.plot(steps[[0, -1]], [start, start], color=colour, lw=0.8, ls=":")
        ax.plot(steps[-1] + 1, tuned, "o", color=colour, ms=5, clip_on=False)
        ax.annotate(name.upper(), (steps[-1] + 1, tuned), (7, 0), textcoords="offset points", va="center", color=colour)
    ax.set_yscale("log")
    ax.set_xlim(None, len(steps) * 1.12)
    ax.set_xlabel("step")
    ax.set_title("costs, starting at the dotted lines", fontsize=10)


def draw_gain(ax: Axes, tuning: Tuning) -> None:
    """Draw the objective of each step's perturbed costs against that of the start on the same arenas."""
    style(ax, "y")
    steps = tuning.history["step"].to_numpy()
    gain = (tuning.history["objective"] - tuning.history["start"]).to_numpy()
    ax.axhline(0, color=INK, lw=1)
    ax.plot(steps, gain, ".", color="#888888", ms=5)
    if len(gain) >= SMOOTH:
        ax.plot(steps[SMOOTH - 1 :], np.convolve(gain, np.ones(SMOOTH) / SMOOTH, "valid"), color=INK, lw=1.5)
    ax.set_xlabel("step")
    ax.set_title("objective of perturbed costs minus start [s]", fontsize=10)


def draw_gaps(ax: Axes, gaps: tuple[Gap, ...]) -> None:
    """Draw differences of the objective on the test arenas."""
    style(ax, "x")
    ax.axvline(0, color=INK, lw=1)
    for y, gap in enumerate(gaps):
        value = gap.objective
        shown = value.low is not None and not value.low <= 0 <= value.high
        colour = "#0072B2" if shown else "#888888"
        if value.low is not None:
            ax.plot([value.low, value.high], [y, y], color=colour, lw=2, solid_capstyle="butt")
        ax.plot(value.estimate, y, "D", color=colour, mfc=colour if shown else "white", ms=6)
        ax.annotate(
            f"{gap.first} minus {gap.second}", (0.0, y), (0, 9), textcoords="offset points",
            xycoords=("axes fraction", "data"), fontsize=8, color=INK,
        )  # fmt: skip
        ax.axhline(y, color=GRID, lw=0.5, zorder=0)
    ax.set_yticks([])
    ax.spines["left"].set_visible(False)
    ax.set_ylim(len(gaps) - 0.5, -0.7)
    ax.set_title("objective on test arenas [s], 95 %", fontsize=10)


def write_tuning(folder: Path, tuning: Tuning, config: TuneConfig, command: str) -> None:
    """Write `costs.toml`, `tune.png` and `summary.md` into an existing folder."""
    comments = (f"Written by: {command}", sentence(tuning))
    write_whole(folder / "costs.toml", lambda file: file.write(costs_toml(tuning.costs[TUNED], comments).encode()))
    write_whole(folder / "tune.png", saver(picture(tuning)))
    lines = ["# Costs tuned", "", f"**{sentence(tuning)}**", "", "![Costs and objective over the steps](tune.png)", ""]
    lines += [to_markdown(costs_sheet(tuning, config)), to_markdown(gaps_sheet(tuning)), how(config), ""]
    lines += ["## How it was made", "", f"- Command: `{command}`", f"- {missions(config)}", ""]
    lines += ["- `costs.toml` is a study file with the tuned costs: `jaxbiped compare costs.toml`."]
    lines += [
        "- `history.parquet`: one row per step; `sweep.parquet`: one per point; `test.parquet`: one per test mission."
    ]
    write_whole(folder / "summary.md", lambda file: file.write(("\n".join(lines) + "\n").encode()))


def missions(config: TuneConfig) -> str:
    """The number of missions, in a sentence."""
    text = f"{config.tuning_missions:,} missions of tuning on {config.arenas:,} training arenas"
    if config.sweep:
        swept = config.sweep_points * config.arenas
        text += f", {swept:,} of a sweep over {config.sweep_points} Sobol points on the same arenas"
    return text + f"; evaluated on {config.test_arenas:,} other arenas."


def how(config: TuneConfig) -> str:
    """The method, for readers of the tables."""
    return (
        f"`{START}`: the costs of the mission. `{TUNED}`: sign descent over {config.steps} steps in the logarithms of "
        f"C1 to C4 with C0 fixed, within {config.low:g} to {config.high:g} C0, on gradients from {config.pairs} pairs "
        f"of perturbed costs per step; the mean over the second half. `{SWEPT}`: the point of lowest objective over "
        f"all training arenas. `{DURATIONS}`: least squares on the durations of the moves, including measurements."
    )
