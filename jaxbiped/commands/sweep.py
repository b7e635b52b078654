"""`jaxbiped sweep`: a study over many points of its config, many of them in one compiled program."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import jax
from rich.console import Console

from jaxbiped.commands.engine_choice import chosen_engine
from jaxbiped.commands.options.sweep import SweepArgs
from jaxbiped.commands.progress_bar import progress
from jaxbiped.config import config_hash
from jaxbiped.devices import cores
from jaxbiped.errors import InputError
from jaxbiped.mission.sensor_rig import try_rig
from jaxbiped.report.folder_report import terminal_report, write_report
from jaxbiped.study.batching import groups_of, shards, strategies_of
from jaxbiped.study.components import fingerprinted
from jaxbiped.study.memory_limit import check_memory
from jaxbiped.study.resumption import refuse_taken
from jaxbiped.study.run_study import compute_study
from jaxbiped.study.runner import check_mission
from jaxbiped.study.sweep import SweepConfig


def main(args: SweepArgs) -> int:
    """Run the command.

    Returns:
      Exit status 0.

    Raises:
      InputError: a sweep that cannot be run, a folder that exists or cannot be written, a full disk.
    """
    config = SweepConfig.model_validate(args.model_dump(include=set(SweepConfig.model_fields)))
    if not config.fields():
        raise InputError(
            "a sweep needs [[axes]] or [sobol] in its file: jaxbiped sweep sweeps/studies/costs.toml", field="axes"
        )
    points = tuple(config.points())
    config = fingerprinted(config)
    strategies = strategies_of(config)
    groups = groups_of(config, points)
    for group in groups:
        arenas = min(config.shard, config.arenas)
        queues = max(cores(), jax.local_device_count())
        check_memory(group.spec, len(group.points), len(group.strategies), arenas, queues)
    for point in points:
        check_mission(point.mission)
    try_rig(config.mission)
    out = args.out or Path("results") / f"sweep-{config_hash(config)}"
    if not args.resume:
        refuse_taken(out)
    console = Console()
    programs = f"{len(groups)} compiled program{'s' * (len(groups) > 1)}"
    what = f"{len(points)} sweep points in {programs}, {config.arenas} arenas each, seed {config.seed}"
    console.print(f"{what}: {', '.join(item.name for item in strategies)}", highlight=False)
    count = len(shards(config, len(groups), swept=True))
    with chosen_engine(args, console, count) as engine, progress(console) as show:
        engine = replace(engine, on_progress=show)
        manifest = compute_study(out, config, points=points, resume=args.resume, engine=engine)
    spent = f"{manifest.wall_time:.0f} s, {manifest.compile_time:.0f} s of them compiling"
    report = write_report(out)
    console.print(terminal_report(report))
    names = ", ".join(["rows", "points.parquet", "manifest.json", *(path.name for path in report.files)])
    console.print(f"{manifest.rows} missions in {spent}; written {out}: {names}", highlight=False)
    return 0
