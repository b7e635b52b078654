"""`jaxbiped reproduce`: repeat the paper's experiments and put both sets of figures on one page."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import jax
import polars as pl
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from jaxbiped.arenas import Arena
from jaxbiped.commands.options.reproduce import ReproduceArgs
from jaxbiped.config import config_hash, parse
from jaxbiped.files import refuse_existing
from jaxbiped.mission.params import SIMULATED, MissionConfig
from jaxbiped.reproduction import EXPERIMENTS, PUBLISHED, fit_measuring
from jaxbiped.reproduction.files import write
from jaxbiped.reproduction.findings import Findings
from jaxbiped.reproduction.gather import MISSIONS, experiment, lintel, mishaps, shortest, strategies
from jaxbiped.reproduction.page import answer
from jaxbiped.reproduction.savings import always, population, study
from jaxbiped.reproduction.staging import load_scenes
from jaxbiped.reproduction.table_1 import SCENES
from jaxbiped.reproduction.table_2 import NAMES, verify_all
from jaxbiped.study import store
from jaxbiped.study.config import StudyConfig
from jaxbiped.study.evaluation import evaluate
from jaxbiped.study.runner import seeing
from jaxbiped.terminal import command_line


def main(args: ReproduceArgs) -> int:
    """Run the command.

    Returns:
      Exit status 0, however the missions end: the page reports that.

    Raises:
      InputError: no scenes, no renderer, a biped that cannot be simulated, a folder that exists or cannot
        be written.
    """
    own = own_parts(args)
    config = parse(MissionConfig, {"sensor": args.sensor, "executor": args.executor} | own)
    identity = config_hash(args.model_copy(update={"out": None})) + (f"-{config_hash(config)}" if own else "")
    out = args.out or Path("results") / f"reproduce-{identity}"
    refuse_existing(out)
    arenas = load_scenes(args.scenes, (*(item.scene for item in EXPERIMENTS), *SCENES))
    if config.executor in SIMULATED:
        from jaxbiped.mission.simulated_driver import rehearse  # loads MuJoCo

        rehearse(config)
    console, began = Console(), time.perf_counter()
    found = gather(args, arenas, config, console)
    facts = {
        "Seed": str(args.seed),
        "Wall time": f"{time.perf_counter() - began:.0f} s",
        "Device": jax.devices()[0].platform,
        "Versions": ", ".join(f"{name} {version}" for name, version in store.versions().items()),
    }
    files = write(out, found, args.model_dump(mode="json") | own, facts, command_line())
    for sentence in answer(found):
        console.print(sentence, highlight=False)
    console.print(f"written {out}: {', '.join(files)}", highlight=False)
    return 0


def own_parts(args: ReproduceArgs) -> dict[str, str]:
    """The user's own robot, camera and preset of the missions in the scenes, where they are not the paper's."""
    given = {"robot": args.robot_file, "camera": args.camera_file}
    files = {part: str(path) for part, path in given.items() if path is not None}
    preset = type(args).model_fields["preset"].default
    return files | ({"preset": args.preset} if args.preset != preset else {})


def gather(args: ReproduceArgs, arenas: dict[str, Arena], config: MissionConfig, console: Console) -> Findings:
    """Play all missions."""
    seeds = range(args.seed, args.seed + args.repeats)
    of_table_1, of_mishaps, of_repeat = MISSIONS
    played = {}
    with seeing(config) as rig:
        with stage(console, "experiments", of_repeat * args.repeats) as done:
            for item in EXPERIMENTS:
                played[item.number] = experiment(item, arenas[item.scene], config, seeds, rig, done)
        with stage(console, "Table 1", of_table_1) as done:
            table_1 = strategies(arenas, config, args.seed, rig, done)
    with stage(console, "what cannot work", of_mishaps) as done:
        endings = mishaps(args.sensor, args.seed, done)
    table_2 = ()
    if args.draws:
        with stage(console, "Table 2", len(NAMES)) as done:
            table_2 = verify_all(config.walk.biped, args.draws, args.seed, done)
    studies = list(crossings(args, console))
    records, shown, logs = ({number: some[k] for number, some in played.items()} for k in range(3))
    fit = fit_measuring([each for some in records.values() for each in some], PUBLISHED, shown)
    measure = fit.seconds if fit else config.durations.measure
    return Findings(
        config=config,
        experiments=records,
        shown=shown,
        logs=logs,
        shortest={item.number: shortest(arenas[item.scene], config, item.strategy) for item in EXPERIMENTS},
        gate_depth=max(lintel(arenas[item.scene]) for item in EXPERIMENTS),
        fit=fit,
        table_1=table_1,
        table_2=table_2,
        endings=endings,
        populations=tuple(population(frame, study, measure, other) for study, frame, other in studies),
    )


def crossings(args: ReproduceArgs, console: Console) -> Iterator[tuple[StudyConfig, pl.DataFrame, pl.DataFrame | None]]:
    """The rows of both populations; for the larger one also those of a robot that always crosses."""
    if args.population:
        config = study(args.population, args.seed, "sampled")
        yield config, rows(config, "random bumps, sampled", console), rows(always(config), "always crossed", console)
    if args.walked:
        config = study(args.walked, args.seed, "native")
        yield config, rows(config, "random bumps, native", console), None


def rows(config: StudyConfig, name: str, console: Console) -> pl.DataFrame:
    """All rows of a study, which is not stored."""
    with stage(console, name, config.arenas * len(config.strategies)) as done:
        return pl.concat([frame for _, frame in evaluate(config, lambda progress: done(progress.ended))])


@contextmanager
def stage(console: Console, name: str, total: int) -> Iterator[Callable[..., None]]:
    """A part of the command: show a bar on a terminal, and print how long it took.

    Yields:
      A function to call after each mission, or with the number of missions that have ended.
    """
    began = time.perf_counter()
    columns = TextColumn(name), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task(name, total=total)
        yield lambda done=None: bar.advance(task) if done is None else bar.update(task, completed=done)
    console.print(f"{name}: {total} in {time.perf_counter() - began:.0f} s", highlight=False)
