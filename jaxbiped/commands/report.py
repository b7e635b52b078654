"""`jaxbiped report`: the tables and figures of a results folder, written anew from its rows."""

from __future__ import annotations

from pathlib import Path

import tyro
from rich.console import Console

from jaxbiped.config import Model
from jaxbiped.report.summary import write_report
from jaxbiped.report.tables import terminal


class ReportArgs(Model):
    """Write summary.md and the figures of a results folder anew, and print its tables."""

    folder: tyro.conf.Positional[Path]
    """A folder that `jaxbiped compare` wrote."""


def main(args: ReportArgs) -> int:
    """Run the command; exit status 0. InputError: no results there, or damaged ones."""
    report = write_report(args.folder)
    console = Console()
    console.print(terminal(report.comparison))
    console.print(f"written {', '.join(str(path) for path in report.files)}", highlight=False)
    return 0
