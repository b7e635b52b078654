"""`jaxbiped compare`: strategies on the same random arenas, with statistics."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from rich.console import Console

from jaxbiped.commands.engine_choice import chosen_engine
from jaxbiped.commands.options.compare import CompareArgs
from jaxbiped.commands.progress_bar import progress
from jaxbiped.config import config_hash
from jaxbiped.errors import InputError
from jaxbiped.mission.sensor_rig import try_rig
from jaxbiped.report.folder_report import terminal_report, write_report
from jaxbiped.statistics.comparison import default_pairs
from jaxbiped.statistics.sequential import Goal
from jaxbiped.study.batching import groups_of, shards, strategies_of
from jaxbiped.study.components import fingerprinted
from jaxbiped.study.config import StudyConfig
from jaxbiped.study.resumption import refuse_taken
from jaxbiped.study.run_study import compute_study, never
from jaxbiped.study.runner import check_mission
from jaxbiped.study.stopping import Rule


def main(args: CompareArgs) -> int:
    """Run the command.

    Returns:
      Exit status 0.

    Raises:
      InputError: a config that cannot be run, a folder that exists or cannot be written, a full disk.
    """
    config = StudyConfig.model_validate(args.model_dump(include=set(StudyConfig.model_fields)))
    config = fingerprinted(config)
    groups = groups_of(config)  # refuses invalid configs first
    strategies = tuple(item.name for item in strategies_of(config))
    goal = goal_of(args, strategies)
    check_mission(config.mission)
    try_rig(config.mission)
    out = args.out or Path("results") / f"compare-{config_hash(config)}"
    if not args.resume:
        refuse_taken(out)
    console = Console()
    names = ", ".join(strategies)
    console.print(
        f"{config.arenas} arenas, seed {config.seed}, sensor {config.mission.sensor}: {names}", highlight=False
    )
    enough = Rule(goal, out, config.arenas) if goal else never
    with (
        chosen_engine(args, console, len(shards(config, len(groups))), ordered=goal is not None) as engine,
        progress(console) as show,
    ):
        engine = replace(engine, on_progress=show)
        manifest = compute_study(out, config, resume=args.resume, engine=engine, enough=enough)
    report = write_report(out)
    console.print(terminal_report(report))
    for sentence in report.remarks:
        console.print(sentence, highlight=False)
    spent = f"{manifest.wall_time:.0f} s, {manifest.compile_time:.0f} s of them compiling"
    names = ", ".join(["rows", "manifest.json", *(path.name for path in report.files)])
    console.print(f"{manifest.rows} missions in {spent}; written {out}: {names}", highlight=False)
    return 0


def goal_of(args: CompareArgs, strategies: tuple[str, ...]) -> Goal | None:
    """The difference to watch; `InputError` if this study does not have it."""
    chosen = {"first": args.first, "second": args.second}
    if args.until_width is None:
        for name in chosen:
            if chosen[name]:
                raise InputError("goes with --until-width, or with a results folder", field=name, value=chosen[name])
        return None
    usual = next(iter(default_pairs(strategies)), None)
    for name, other in (("first", "second"), ("second", "first")):
        strategy = chosen[name]
        if (strategy and strategy not in strategies) or usual is None:
            message = f"must be one of the strategies ({', '.join(strategies)}), and the study must have at least two"
            raise InputError(message, field=name, value=strategy)
        if strategy and strategy == chosen[other]:
            raise InputError("must differ from the other side", field=name, value=strategy)
    rest = [name for name in (*usual, *strategies) if name not in chosen.values()]
    first, second = (chosen[name] or rest.pop(0) for name in ("first", "second"))
    if args.measure == "success" and args.until_width >= 2:
        raise InputError(
            "must be below 2 for success: no interval is wider", field="until-width", value=args.until_width
        )
    return Goal(args.measure, first, second, args.until_width)
