"""The HTML page of a sweep: what changes over its points, then the strategies at one of them."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path

import polars as pl
from matplotlib.figure import Figure

from jaxbiped.errors import InputError
from jaxbiped.files import write_whole
from jaxbiped.report.answer_text import DISTANCE, TIME, listed
from jaxbiped.report.comparison_report import LIMITATIONS, looked_at
from jaxbiped.report.figures import INK, canvas, error_bars, legend_above, look
from jaxbiped.report.grid import to_grid, typeset
from jaxbiped.report.metric_figure import own_metric
from jaxbiped.report.page import PAGE, PageNotes, Section, page_of, render
from jaxbiped.report.page_figures import WIDTH, Plot
from jaxbiped.report.svg import inline, themed
from jaxbiped.report.sweep import LIMITATIONS as OF_SWEEPS
from jaxbiped.report.sweep import SweepReport, grid_axes
from jaxbiped.report.sweep_figures import Panel, difference_panels, dots, heat_map, rate_panels, scale_x
from jaxbiped.statistics import compare
from jaxbiped.statistics.sweep_points import PointResult, SweepResult
from jaxbiped.study import read

MOST_ROWS = 256  # in a table; for more rows the page says where to find them


def write_sweep_page(
    report: SweepReport, *, point: int | None = None, resamples: int = 4999, examples: int = 0
) -> Path:
    """Write `report.html` into a sweep's folder.

    Args:
      report: report of the sweep.
      point: where strategies are compared in full; by default that with the config's own values, else the first.
      resamples: resamples of the bootstraps at that point.
      examples: arenas to be replayed and drawn there, see `folder_report.write_report`.

    Raises:
      InputError: a point that has no rows, or a file that cannot be written.
    """
    result, manifest, folder = report.result, report.manifest, report.folder
    if point is None:
        point = result.points[0].index if result.reference is None else result.reference
    chosen = next((item for item in result.points if item.index == point), None)
    if chosen is None:
        allowed = f"must be a sweep point with rows, {result.points[0].index} to {result.points[-1].index}"
        raise InputError(allowed, file=folder, field="point", value=point)
    rows = read(folder).rows
    frame = rows.filter(pl.col("point") == point)
    comparison = compare(frame, point=point, seed=manifest.seed, resamples=resamples, shown=manifest.metrics)
    page = page_of(
        frame,
        comparison,
        manifest,
        PageNotes(
            title=title(report),
            limitations=tuple(dict.fromkeys((*OF_SWEEPS, *LIMITATIONS))),
            commands=(manifest.command, shlex.join(["jaxbiped", "report", str(folder)])),
            more=looked_at(folder, frame, comparison, manifest, examples),
        ),
    )
    kicker = f"jaxbiped · {len(result.points):,} sweep points · {page.kicker.partition(' · ')[2]}"
    at = f"At point {point}: {listed([f'{name} {value:g}' for name, value in chosen.values.items()])}"
    text = "Everything below is about this point; the option --point of jaxbiped report chooses another."
    page = replace(
        page,
        kicker=kicker,
        answer=tuple(typeset(sentence) for sentence in report.sentences),
        keys=(),
        sections=(over(report, rows), Section(at, (text,)), *page.sections),
        warnings=() if manifest.state == "finished" else ("This sweep is not finished: some arenas are missing.",),
    )
    path = folder / PAGE
    write_whole(path, lambda file: file.write(render(page).encode()))
    return path


def title(report: SweepReport) -> str:
    """The sweep's own question, or one made from its axes."""
    asked = report.manifest.config.get("question")
    if asked:
        return asked
    what = listed(report.result.fields)
    if report.result.question is None:
        return f"How does {report.result.strategies[0]} depend on {what}?"
    first, second = report.result.question
    return f"How does the difference between {first} and {second} depend on {what}?"


def over(report: SweepReport, frame: pl.DataFrame) -> Section:
    """Figures and tables over all points.

    Args:
      frame: the rows that the report was made from.
    """
    grids = []
    for sheet in report.sheets:
        (rows,) = sheet.groups
        notes = sheet.notes
        if len(rows) > MOST_ROWS:
            notes = (*notes, f"The first {MOST_ROWS} of {len(rows):,} points; summary.md has them all.")
        grids.append(to_grid(replace(sheet, groups=(rows[:MOST_ROWS],), notes=notes)))
    with themed():
        axes = grid_axes(report.manifest)
        plots = sweep_plots(report.result, axes)
        if len(axes) == 1:
            plots = (plots[0], *own_plots(report.result, frame, axes[0]), *plots[1:])
    return Section("Over the sweep", plots=plots, grids=tuple(grids))


def sweep_plots(result: SweepResult, axes: tuple[str, ...]) -> tuple[Plot, ...]:
    """A line for each quantity over one axis, a heat map over two, otherwise dots over each field."""
    panels = difference_panels(result)
    drawn: list[tuple[str, Figure, str]] = []
    level = f"with intervals at {100 * result.level:g} %"
    if len(axes) == 1:
        drawn.append(("sweep-rates", rate_lines(result, axes[0]), f"Success of each strategy, {level}."))
        for k, panel in enumerate(panels):
            drawn.append((f"sweep-{k}", difference_line(result, axes[0], panel), f"{plain(panel)}, {level}."))
    elif len(axes) == 2:
        for k, panel in enumerate((*panels, *rate_panels(result))):
            caption = f"{plain(panel)}."
            if panel.signed:
                caption += f" Blue: {result.question[0]} is better. Framed: the interval excludes zero."
            drawn.append((f"sweep-{k}", heat_map(result, *axes, panels=(panel,)), caption))
    else:
        for k, field in enumerate(result.fields):
            one = replace(result, points=tuple(only(point, field) for point in result.points))
            drawn.append((f"sweep-{k}", dots(one), f"Each dot is a sweep point, drawn over {field}."))
    return tuple(Plot(inline(figure, name, caption), caption) for name, figure, caption in drawn)


def own_plots(result: SweepResult, frame: pl.DataFrame, field: str) -> tuple[Plot, ...]:
    """The mean distance and time of each strategy's own reached missions against one field."""
    points = pl.DataFrame(
        {"point": [point.index for point in result.points], field: [point.values[field] for point in result.points]},
        schema={"point": pl.Int32, field: pl.Float64},
    )
    plots = []
    for measure in (DISTANCE, TIME):
        caption = f"Mean {measure.name} of each strategy's own reached missions, with intervals at 95 %."
        figure = own_metric(frame, points, measure.name, (WIDTH, 3.4))
        plots.append(Plot(inline(figure, f"sweep-own-{measure.name}", caption), caption))
    return tuple(plots)


def plain(panel: Panel) -> str:
    """A panel's title on one line."""
    return panel.title.replace("\n", " ").replace(" [%]", ", in %")


def only(point: PointResult, field: str) -> PointResult:
    """A point as if only one field were swept."""
    return replace(point, values={field: point.values[field]})


def rate_lines(result: SweepResult, field: str) -> Figure:
    """Success of each strategy against one field."""
    figure, ax = canvas(WIDTH, 3.4)
    for name in result.strategies:
        found = [(point.values[field], point.success[name]) for point in result.points if name in point.success]
        error_bars(ax, found, name, look(name, result.strategies), 100.0, line=True)
    scale_x(ax, [point.values[field] for point in result.points])
    ax.set_xlabel(field)
    ax.set_ylabel("reached the goal [%]")
    legend_above(figure, ax, columns=3)
    return figure


def difference_line(result: SweepResult, field: str, panel: Panel) -> Figure:
    """One measure of the question's pair against one field."""
    figure, ax = canvas(WIDTH, 3.4)
    ax.axhline(0, color=INK, lw=1)
    found = [(point.values[field], panel.of(point)) for point in result.points]
    found = [(x, value) for x, value in found if value and value.valid and value.low is not None]
    error_bars(ax, found, "", ("#0072B2", "o"), panel.scale, line=True)
    scale_x(ax, [point.values[field] for point in result.points])
    ax.set_xlabel(field)
    ax.set_title(panel.title)
    return figure
