"""Progress of a study, on a terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from jaxbiped.study.evaluation import Progress as Done


@contextmanager
def progress(console: Console) -> Iterator[Callable[[Done], None]]:
    """A bar on a terminal, with missions done, their rate, how many failed, and the time left; elsewhere nothing."""
    columns = (
        TextColumn("missions"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]:.0f}/s, {task.fields[failed]:.1f} % failed"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, disable=not sys.stdout.isatty(), transient=True) as bar:
        task = bar.add_task("missions", total=None, rate=0.0, failed=0.0)
        first: list[tuple[float, int]] = []

        def show(done: Done) -> None:
            first.append((time.perf_counter(), done.ended)) if not first else None
            spent = time.perf_counter() - first[0][0]
            rate = (done.ended - first[0][1]) / spent if spent > 0 else 0.0
            failed = 100 * (1 - done.reached / done.ended) if done.ended else 0.0
            bar.update(task, completed=done.ended, total=done.total, rate=rate, failed=failed)

        yield show
