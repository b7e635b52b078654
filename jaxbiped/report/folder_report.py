"""The report of a results folder, whether it holds a comparison or a sweep."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from rich.console import Group

from jaxbiped.report.comparison_report import Report, write_comparison_report
from jaxbiped.report.sweep import SweepReport, write_sweep_report
from jaxbiped.report.sweep import terminal as sweep_terminal
from jaxbiped.report.sweep_page import write_sweep_page
from jaxbiped.report.tables import terminal as comparison_terminal
from jaxbiped.study import read_points


def write_report(
    folder: str | Path, *, point: int | None = None, resamples: int | None = None, examples: int = 0
) -> Report | SweepReport:
    """Write `report.html`, `summary.md` and figures into a results folder; for several points, those of a sweep.

    May be called again at any time: the same rows give the same report.

    Args:
      point: point at which strategies are compared in full; for a sweep, by default that with the config's own values.
      resamples: resamples of the bootstraps; by default 4999, and 999 at each point of a sweep.
      examples: number of arenas where the two strategies of the question differ most, to be replayed and drawn; this
        compiles a mission.

    Raises:
      InputError: no results, damaged results, no rows, no such point, or files that cannot be written.
    """
    options = {} if resamples is None else {"resamples": resamples}
    if len(read_points(folder)) == 1:
        return write_comparison_report(folder, point=point or 0, examples=examples, **options)
    report = write_sweep_report(folder, **options)
    page = write_sweep_page(report, point=point, examples=examples, **options)
    return replace(report, files=(page, *report.files))


def terminal_report(report: Report | SweepReport) -> Group:
    """The part of a report that is printed."""
    return sweep_terminal(report) if isinstance(report, SweepReport) else comparison_terminal(report.comparison)
