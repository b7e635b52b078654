"""`jaxbiped compare`: strategies on the same random arenas, with statistics."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from jaxbiped.arenas.families import SIZE_X, SIZE_Y
from jaxbiped.commands.progress import progress
from jaxbiped.config import config_hash
from jaxbiped.files import refuse_existing
from jaxbiped.mission.settings import SIMULATED, program
from jaxbiped.report.summary import write_report
from jaxbiped.report.tables import terminal
from jaxbiped.study.conduct import conduct
from jaxbiped.study.config import StudyConfig


class CompareArgs(StudyConfig):
    """Compare strategies on random arenas: missions, paired statistics, tables and figures.

    A study in TOML may come first; options on the command line override it.
    """

    out: Path | None = None
    """Folder to write, which must not exist. Default: results/compare-<hash of the study>."""
    resume: bool = False
    """Go on with the same study in the folder, where it was stopped; or begin it."""


def main(args: CompareArgs) -> int:
    """Run the command.

    Returns:
      Exit status 0.

    Raises:
      InputError: a config that cannot be run, a folder that exists or cannot be written, a full disk.
    """
    config = StudyConfig.model_validate(args.model_dump(exclude={"out", "resume"}))
    program(config.mission, (SIZE_X, SIZE_Y))  # refuses what does not fit before anything is written
    if config.mission.executor in SIMULATED:
        from jaxbiped.mission.walking import rehearse  # loads MuJoCo

        rehearse(config.mission)
    out = args.out or Path("results") / f"compare-{config_hash(config)}"
    if not args.resume:
        refuse_existing(out)
    console = Console()
    names = ", ".join(config.strategies)
    console.print(
        f"{config.arenas} arenas, seed {config.seed}, sensor {config.mission.sensor}: {names}", highlight=False
    )
    with progress(console) as show:
        manifest = conduct(out, config, resume=args.resume, on_progress=show)
    report = write_report(out)
    console.print(terminal(report.comparison))
    spent = f"{manifest.wall_time:.0f} s, {manifest.compile_time:.0f} s of them compiling"
    console.print(f"{manifest.rows} missions in {spent}; written {out}", highlight=False)
    return 0
