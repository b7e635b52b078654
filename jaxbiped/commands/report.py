"""`jaxbiped report`: the tables and figures of a results folder, written anew from its rows."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import pydantic
import tyro
from rich.console import Console

from jaxbiped.config import Model
from jaxbiped.report.summary import write_report
from jaxbiped.report.sweep import terminal as sweep_terminal
from jaxbiped.report.sweep import write_sweep_report
from jaxbiped.report.sweep_page import write_sweep_page
from jaxbiped.report.tables import terminal
from jaxbiped.study import read_points


class ReportArgs(Model):
    """Write report.html, summary.md and the figures of a results folder anew, and print its tables."""

    folder: tyro.conf.Positional[Path]
    """A folder that `jaxbiped compare` or `jaxbiped sweep` wrote."""
    point: Annotated[int, pydantic.Field(ge=0)] | None = None
    """Of a sweep: the point at which strategies are compared in full; by default that with the config's own values."""
    examples: Annotated[int, pydantic.Field(ge=0, le=50)] = 3
    """Arenas where the two strategies differ most, to be played again and drawn; that compiles a mission. 0: none."""


def main(args: ReportArgs) -> int:
    """Run the command; exit status 0. InputError: no results there, or damaged ones."""
    if len(read_points(args.folder)) > 1:
        sweep = write_sweep_report(args.folder)
        files = (write_sweep_page(sweep, point=args.point, examples=args.examples), *sweep.files)
        said = sweep_terminal(sweep)
    else:
        report = write_report(args.folder, point=args.point or 0, examples=args.examples)
        files, said = report.files, terminal(report.comparison)
    console = Console()
    console.print(said)
    names = ", ".join(str(path.relative_to(args.folder)) for path in files)
    console.print(f"written {args.folder}: {names}", highlight=False)
    return 0
