"""`jaxbiped report`: the tables and figures of a results folder, written anew from its rows."""

from __future__ import annotations

from rich.console import Console

from jaxbiped.commands.options.report import ReportArgs
from jaxbiped.report.summary import write_report
from jaxbiped.report.sweep import terminal as sweep_terminal
from jaxbiped.report.sweep import write_sweep_report
from jaxbiped.report.sweep_page import write_sweep_page
from jaxbiped.report.tables import terminal
from jaxbiped.study import read_points


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
