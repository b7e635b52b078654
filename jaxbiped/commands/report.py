"""`jaxbiped report`: rewrite the tables and figures of a results folder from its rows."""

from __future__ import annotations

from rich.console import Console

from jaxbiped.commands.options.report import ReportArgs
from jaxbiped.report.folder_report import terminal_report, write_report


def main(args: ReportArgs) -> int:
    """Run the command and return exit status 0. InputError: results that are missing or damaged."""
    report = write_report(args.folder, point=args.point, examples=args.examples)
    console = Console()
    console.print(terminal_report(report))
    names = ", ".join(str(path.relative_to(args.folder)) for path in report.files)
    console.print(f"written {args.folder}: {names}", highlight=False)
    return 0
