"""`jaxbiped report`: the tables and figures of a results folder, written anew from its rows."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import pydantic
import tyro
from rich.console import Console

from jaxbiped.config import Model
from jaxbiped.report.summary import write_report
from jaxbiped.report.tables import terminal


class ReportArgs(Model):
    """Write report.html, summary.md and the figures of a results folder anew, and print its tables."""

    folder: tyro.conf.Positional[Path]
    """A folder that `jaxbiped compare` or `jaxbiped sweep` wrote."""
    point: Annotated[int, pydantic.Field(ge=0)] = 0
    """Of a sweep: the sweep point that strategies are compared at."""
    examples: Annotated[int, pydantic.Field(ge=0, le=50)] = 3
    """Arenas where the two strategies differ most, to be played again and drawn; that compiles a mission. 0: none."""


def main(args: ReportArgs) -> int:
    """Run the command; exit status 0. InputError: no results there, or damaged ones."""
    report = write_report(args.folder, point=args.point, examples=args.examples)
    console = Console()
    console.print(terminal(report.comparison))
    names = ", ".join(str(path.relative_to(args.folder)) for path in report.files)
    console.print(f"written {args.folder}: {names}", highlight=False)
    return 0
