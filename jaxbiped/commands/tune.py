"""`jaxbiped tune`: costs that make missions short, found on training arenas and evaluated on others."""

from __future__ import annotations

import io
import json
import time
from functools import partial
from pathlib import Path
from typing import BinaryIO

import polars as pl
from rich.console import Console

from jaxbiped.arenas.families import SIZE_X, SIZE_Y
from jaxbiped.commands.options.tune import TuneArgs
from jaxbiped.commands.progress_bar import progress
from jaxbiped.config import config_hash
from jaxbiped.errors import InputError
from jaxbiped.executors.motion_library import load_library
from jaxbiped.files import new_folder, refuse_existing, write_whole
from jaxbiped.mission.params import mission_spec
from jaxbiped.motion.config import DurationConfig
from jaxbiped.report.tables import to_markdown, to_rich
from jaxbiped.report.tuning import costs_sheet, costs_toml, fits_sheet, gaps_sheet, missions, sentence, write_tuning
from jaxbiped.study import store
from jaxbiped.study.durations import Fit, fit, table_2
from jaxbiped.study.tuning import TuneConfig, Tuning, tune
from jaxbiped.terminal import command_line


def main(args: TuneArgs) -> int:
    """Run the command.

    Returns:
      Exit status 0.

    Raises:
      InputError: a config that cannot be run, a folder that exists or cannot be written, a full disk.
    """
    config = TuneConfig.model_validate(args.model_dump(exclude={"out", "from_durations"}))
    mission_spec(config.mission, (SIZE_X, SIZE_Y))  # refuses invalid configs before anything is computed
    refuse_timeless(config)
    kind = f"-{args.from_durations}" if args.from_durations else ""
    out = args.out or Path("results") / f"tune{kind}-{config_hash(config)}"
    refuse_existing(out)
    console, command = Console(), command_line()
    if args.from_durations:
        return fitted(config, args.from_durations, out, command, console)
    console.print(f"{missions(config)}", highlight=False)
    start = time.perf_counter()
    with progress(console) as show:
        tuning = tune(config, on_progress=show)
    wall = time.perf_counter() - start
    with new_folder(out) as folder:
        write_manifest(folder, config, command, wall)
        for name, table in tables(tuning).items():
            buffer = io.BytesIO()  # polars would raise its own error on a full disk
            table.write_parquet(buffer)
            write_whole(folder / f"{name}.parquet", partial(write, buffer.getvalue()))
        write_tuning(folder, tuning, config, command)
        files = sorted(path.name for path in folder.iterdir())
    console.print(to_rich(costs_sheet(tuning, config)), "", to_rich(gaps_sheet(tuning)), "", sentence(tuning))
    console.print(f"{wall:.0f} s; written {out}: {', '.join(files)}", highlight=False)
    return 0


def tables(tuning: Tuning) -> dict[str, pl.DataFrame]:
    """The stored tables, by file name."""
    return {"history": tuning.history, "sweep": tuning.swept, "test": tuning.test}


def refuse_timeless(config: TuneConfig) -> None:
    """Raise `InputError` if durations carry no information: a move and a measurement that both take no time."""
    durations = config.mission.durations
    if durations.straight + durations.measure <= 0:
        raise InputError("must be above 0, or measure must", field="durations.straight", value=durations.straight)


def fits(config: TuneConfig, source: str) -> dict[str, Fit]:
    """The fits of `from_durations`, by name."""
    durations = config.mission.durations
    if source == "library":
        library = load_library(config.mission.library)
        durations = table_2(library).model_copy(update={"measure": durations.measure})
    if durations.straight <= 0:
        raise InputError("must be above 0 to fit costs to", field="durations.straight", value=durations.straight)
    return {
        "straight moves": fit(durations, diagonal=False),
        "straight and diagonal": fit(durations),
        f"the same, {durations.measure:g} s of measuring per move": fit(durations, measuring=True),
    }


def fitted(config: TuneConfig, source: str, out: Path, command: str, console: Console) -> int:
    """`--from-durations`: costs in closed form. Writes those with measurements, which count in a mission's time."""
    measure = config.mission.durations.measure
    table = "Table 2" if config.mission.durations == DurationConfig(measure=measure) else "the durations given"
    title = f"Costs from {table if source == 'table' else 'measured primitives'}"
    found = fits(config, source)
    sheet = fits_sheet(found, title)
    last = list(found.values())[-1]
    costs = tuple(float(f"{cost:.4g}") for cost in (max(last.costs[0], 0.1), *last.costs[1:], config.mission.costs.c4))
    comments = (
        f"Written by: {command}",
        "C0 to C3 from durations, including one measurement per move; C4 cannot be derived from these.",
    )
    with new_folder(out) as folder:
        write_manifest(folder, config, command, None)
        write_whole(folder / "costs.toml", lambda file: file.write(costs_toml(costs, comments).encode()))
        text = f"# Costs from durations\n\n{to_markdown(sheet)}\n- Command: `{command}`\n"
        write_whole(folder / "summary.md", lambda file: file.write(text.encode()))
        files = sorted(path.name for path in folder.iterdir())
    console.print(to_rich(sheet), "")
    console.print(f"written {out}: {', '.join(files)}", highlight=False)
    return 0


def write(content: bytes, file: BinaryIO) -> None:
    """Write content to an open file."""
    file.write(content)


def write_manifest(folder: Path, config: TuneConfig, command: str, wall: float | None) -> None:
    """Write `manifest.json`: how the folder was made."""
    manifest = {
        "command": command,
        "config": config.model_dump(mode="json"),
        "config_hash": config_hash(config),
        "versions": store.versions(),
        "device": store.device(),
        "wall_time": wall,
    }
    text = json.dumps(manifest, indent=2) + "\n"
    write_whole(folder / "manifest.json", lambda file: file.write(text.encode()))
