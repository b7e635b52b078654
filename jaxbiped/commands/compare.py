"""`jaxbiped compare`: strategies on the same random arenas, with statistics."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from jaxbiped.arenas.families import SIZE_X, SIZE_Y
from jaxbiped.config import config_hash
from jaxbiped.files import refuse_existing
from jaxbiped.mission.settings import SIMULATED, program
from jaxbiped.report.summary import write_report
from jaxbiped.report.tables import terminal
from jaxbiped.study import store
from jaxbiped.study.evaluate import CompileClock, StudyConfig, evaluate
from jaxbiped.study.evaluate import Progress as Done


class CompareArgs(StudyConfig):
    """Compare strategies on random arenas: missions, paired statistics, tables and figures.

    A study in TOML may come first; options on the command line override it.
    """

    out: Path | None = None
    """Folder to write, which must not exist. Default: results/compare-<hash of the study>."""


def main(args: CompareArgs) -> int:
    """Run the command.

    Returns:
      Exit status 0.

    Raises:
      InputError: a config that cannot be run, a folder that exists or cannot be written, a full disk.
    """
    config = StudyConfig.model_validate(args.model_dump(exclude={"out"}))
    program(config.mission, (SIZE_X, SIZE_Y))  # refuses what does not fit before anything is written
    if config.mission.executor in SIMULATED:
        from jaxbiped.mission.walking import rehearse  # loads MuJoCo

        rehearse(config.mission)
    out = args.out or Path("results") / f"compare-{config_hash(config)}"
    refuse_existing(out)
    console = Console()
    clock, start = CompileClock(), time.perf_counter()
    names = ", ".join(config.strategies)
    console.print(
        f"{config.arenas} arenas, seed {config.seed}, sensor {config.mission.sensor}: {names}", highlight=False
    )
    with store.create(out, config, seed=config.seed, arenas=config.arenas) as results, progress(console) as show:
        for frame in evaluate(config, show):
            results.append(frame)
        results.finish(compile_time=clock.seconds)
    missions = config.arenas * len(config.strategies)
    wall = time.perf_counter() - start
    report = write_report(out)
    console.print(terminal(report.comparison))
    console.print(
        f"{missions} missions in {wall:.0f} s, {clock.seconds:.0f} s of them compiling; written {out}", highlight=False
    )
    return 0


@contextmanager
def progress(console: Console) -> Iterator:
    """A bar on a terminal; nothing elsewhere."""
    columns = (
        TextColumn("missions"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]:.0f}/s"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, disable=not sys.stdout.isatty(), transient=True) as bar:
        task = bar.add_task("missions", total=None, rate=0.0)
        first: list[tuple[float, int]] = []

        def show(done: Done) -> None:
            first.append((time.perf_counter(), done.ended)) if not first else None
            spent = time.perf_counter() - first[0][0]
            rate = (done.ended - first[0][1]) / spent if spent > 0 else 0.0
            bar.update(task, completed=done.ended, total=done.total, rate=rate)

        yield show
