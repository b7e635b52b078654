"""The report of a sweep: tables, a figure and `summary.md`, rewritten from its rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import polars as pl
from rich.console import Group

from jaxbiped.errors import InputError
from jaxbiped.files import write_whole
from jaxbiped.report.answer_text import MEASURES, Measure
from jaxbiped.report.figures import saver
from jaxbiped.report.sweep_answer import difference, sentences
from jaxbiped.report.sweep_figures import sweep_figure
from jaxbiped.report.tables import Sheet, to_markdown, to_rich
from jaxbiped.report.words import NONE, brackets, number, percent
from jaxbiped.statistics import CODES
from jaxbiped.statistics.idle_axes import idle_spans
from jaxbiped.statistics.sweep_points import PointResult, SweepResult, pointwise
from jaxbiped.study import Manifest, read, read_points

SUMMARY, FIGURE = "summary.md", "sweep.png"
ROWS = 24  # of a table on a terminal

LIMITATIONS = (
    "Each interval is for one sweep point, at the stated level, without correction for their number. The best of "
    "many points looks better than it is.",
    "Distance and time are compared on arenas that both sides solved, the easier ones.",
    "All points have the same arenas and the same noise seeds, so differences between points are paired as well.",
)


@dataclass(frozen=True)
class SweepReport:
    """The parts of a sweep's report."""

    folder: Path
    result: SweepResult
    manifest: Manifest
    sheets: tuple[Sheet, ...]
    sentences: tuple[str, ...]
    files: tuple[Path, ...]  # written


def write_sweep_report(folder: str | Path, *, resamples: int = 999) -> SweepReport:
    """Read a sweep's folder, and write its figure and `summary.md` into it. The same rows give the same report.

    Raises:
      InputError: no results, damaged ones, no rows yet, or files that cannot be written.
    """
    folder = Path(folder)
    frame, manifest = read(folder)
    if frame.is_empty():
        raise InputError("has no rows to report on yet", file=folder)
    points = read_points(folder)
    result = pointwise(frame, points, manifest.config, seed=manifest.seed, resamples=resamples)
    figure, caption = sweep_figure(result, grid_axes(manifest))
    write_whole(folder / FIGURE, saver(figure))
    shown = (*sheets(result), ending_sheet(frame, result.strategies))
    said = sentences(result, idle_spans(frame, points, changed_together(manifest)))
    text = summary(manifest, shown, said, caption)
    write_whole(folder / SUMMARY, lambda file: file.write(text.encode()))
    return SweepReport(folder, result, manifest, shown, said, (folder / SUMMARY, folder / FIGURE))


def grid_axes(manifest: Manifest) -> tuple[str, ...]:
    """The field of each axis that has more than one value; none if there are Sobol points."""
    if manifest.config.get("sobol"):
        return ()
    axes = manifest.config.get("axes", ())
    return tuple(axis["field"] for axis in axes if axis["values"] is None or len(axis["values"]) > 1)


def changed_together(manifest: Manifest) -> dict[str, tuple[str, ...]]:
    """The field of each axis that has more than one value, and the fields that change together with it."""
    together = {axis["field"]: tuple(axis.get("together", ())) for axis in manifest.config.get("axes", ())}
    return {field: together[field] for field in grid_axes(manifest)}


def terminal(report: SweepReport) -> Group:
    """The output of a sweep on the terminal."""
    blocks = []
    for sheet in report.sheets:
        rows = sheet.groups[0]
        notes = sheet.notes
        if len(rows) > ROWS:
            notes = (*notes, f"The first {ROWS} of {len(rows)}; all are in {SUMMARY}.")
        blocks += [to_rich(Sheet(sheet.title, sheet.columns, (rows[:ROWS],), notes)), ""]
    return Group(*blocks, *report.sentences)


def sheets(result: SweepResult) -> tuple[Sheet, ...]:
    """Success of each strategy, the question's pair, and each point against the reference."""
    level = f"Intervals at {100 * result.level:g} %."
    rates = sheet(
        "Success at each sweep point [%]",
        result,
        {name: lambda point, name=name: rate(point, name) for name in result.strategies},
        (f"{level} {result.points[0].success[result.strategies[0]].n} arenas, the same at each point.",),
    )
    made = [rates]
    if result.question:
        first, second = result.question
        columns = {titled(m): lambda point, m=m: difference(point.pair, m) for m in MEASURES}
        note = "Distance and time where both arrived."
        made.append(sheet(f"{first} minus {second} on the same arenas", result, columns, (level, note)))
    if result.reference is not None and len(result.points) > 1:
        for name in result.strategies:
            columns = {titled(m): lambda point, m=m, name=name: difference(point.change.get(name), m) for m in MEASURES}
            title = f"{name}: each point minus point {result.reference}, the config's own values"
            made.append(sheet(title, result, columns, (level,)))
    return tuple(made)


def ending_sheet(frame: pl.DataFrame, strategies: Sequence[str]) -> Sheet:
    """How the missions of each strategy ended, over all points; codes that never occurred are left out."""
    counts = dict(frame.group_by(pl.col("strategy", "code").cast(pl.String)).len().rows_by_key(["strategy", "code"]))
    number_of = {key: found[0][-1] for key, found in counts.items()}
    seen = [code for code in CODES if any((name, code) in number_of for name in strategies)]
    rows = tuple((name, *(str(number_of.get((name, code), 0)) for code in seen)) for name in strategies)
    columns = ("strategy", *(code.replace("_", " ") for code in seen))
    return Sheet("How missions ended, at all points together", columns, (rows,))


def sheet(
    title: str, result: SweepResult, columns: dict[str, Callable[[PointResult], str]], notes: tuple[str, ...]
) -> Sheet:
    """A row for each sweep point: its values, then the cells of `columns`."""
    rows = [
        (
            str(point.index),
            *(f"{value:.4g}" for value in point.values.values()),
            *(say(point) for say in columns.values()),
        )
        for point in result.points
    ]
    return Sheet(title, ("point", *short(result.fields), *columns), (tuple(rows),), notes)


def short(fields: Sequence[str]) -> tuple[str, ...]:
    """The last parts of dotted names, if those are all different."""
    last = tuple(name.rpartition(".")[2] for name in fields)
    return last if len(set(last)) == len(last) else tuple(fields)


def titled(measure: Measure) -> str:
    """The heading of a column."""
    return f"{measure.name}, {measure.unit}"


def rate(point: PointResult, strategy: str) -> str:
    """A success rate with its interval."""
    value = point.success.get(strategy)
    return f"{percent(value.estimate)} {brackets(value, 100.0, 1, sign=False)}" if value else NONE


def summary(manifest: Manifest, tables: tuple[Sheet, ...], said: tuple[str, ...], caption: str) -> str:
    """The text of `summary.md`."""
    lines = ["# Sweep", ""]
    if manifest.config.get("question"):
        lines += [f"**{manifest.config['question']}**", ""]
    if manifest.state != "finished":
        lines += ["**This sweep is not finished: points may have fewer arenas than others, or be missing.**", ""]
    lines += [*(f"- {text}" for text in said), "", f"![{caption}]({FIGURE})", "", f"*{caption}*", "", "## Tables", ""]
    lines += [to_markdown(table) for table in tables]
    lines += ["## Limitations", "", *(f"- {text}" for text in LIMITATIONS), ""]
    versions = ", ".join(f"{name} {version}" for name, version in manifest.versions.items())
    return "\n".join(
        [
            *lines,
            "## How it was made",
            "",
            f"- Command: `{manifest.command}`",
            f"- Config hash: `{manifest.config_hash}`; seed {manifest.seed}; started {manifest.started}",
            f"- Wall time: {number(manifest.wall_time, 1)} s; compilation: {number(manifest.compile_time, 1)} s",
            f"- Device: {manifest.device}",
            f"- Versions: {versions}",
            "- Rows: `rows/*.parquet`, one row per mission; `points.parquet`: the sweep points",
            "",
        ]
    )
