"""Run a study from its config into a results folder, from the start or from where it was stopped."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from jaxbiped.mission.metric import format_of
from jaxbiped.study import shard_files, store
from jaxbiped.study.batching import Point, Shard, groups_of, metrics_of, only_point, shards
from jaxbiped.study.clock import CompileClock
from jaxbiped.study.components import fingerprinted
from jaxbiped.study.config import StudyConfig
from jaxbiped.study.evaluation import Progress, evaluate
from jaxbiped.study.resumption import resume as take_up


@dataclass(frozen=True)
class Engine:
    """How the shards of a study are computed."""

    # Called like `evaluation.evaluate`, which computes in this process. It chooses the order of shards.
    compute: Callable[..., Iterator[tuple[Shard, pl.DataFrame]]] = evaluate
    device: str = ""  # its device, in words; "": that of this process
    compile_time: Callable[[], float] | None = None  # [s] spent compiling so far; None: the time of this process
    on_progress: Callable[[Progress], None] | None = None


HERE = Engine()  # this process


def never(frame: pl.DataFrame) -> bool:
    """The rule that wants all arenas."""
    return False


def compute_study(
    folder: str | Path,
    config: StudyConfig,
    *,
    points: Sequence[Point] | None = None,
    resume: bool = False,
    engine: Engine = HERE,
    enough: Callable[[pl.DataFrame], bool] = never,
) -> store.Manifest:
    """Compute a study and store it, shard by shard. A process that dies loses at most the current shard.

    Args:
      folder: must not exist or be empty; with `resume`, one where the same study was stopped, or none yet.
      points: sweep points; by default the one of `config`.
      enough: called with each shard once, in order of their numbers; returns whether the study can end there.

    Raises:
      InputError: an unsuitable folder, or a full disk; stored shards stay readable.
    """
    clock, config = CompileClock(), fingerprinted(config)
    compile_time = engine.compile_time or (lambda: clock.seconds)
    swept = points is not None
    points = tuple(points) if swept else only_point(config)
    groups = groups_of(config, points)  # rejects invalid combinations before anything is written
    header = store.StudyHeader(
        config=config,
        seed=config.seed,
        arenas=config.arenas,
        points=table(points) if swept else None,
        device_name=engine.device,
        metrics={name: format_of(metric, name) for name, metric in metrics_of(config).items()},
    )
    if resume:
        results = take_up(folder, header, shard_rows(config, points, swept=swept))
    else:
        results = store.create(folder, header)
    with results:
        judge = in_order(enough, parts=1 if swept else len(groups))
        paths = shard_files.shard_paths(results.folder) if enough is not never else []
        if not any(judge(shard_files.shard_number(path), pl.read_parquet(path)) for path in paths):
            given = {"points": points if swept else None, "done": results.done()}
            for shard, frame in engine.compute(config, engine.on_progress, **given):
                results.append(frame, shard.number, compile_time=compile_time())
                if judge(shard.number, frame):
                    break
        return results.finish(compile_time=compile_time())


def in_order(enough: Callable[[pl.DataFrame], bool], parts: int = 1) -> Callable[[int, pl.DataFrame], bool]:
    """`enough` for shards that arrive in any order, with their numbers: they wait for those with lower numbers.

    Which shard ends first depends on its content, so a rule that saw them as they arrive would be biased.

    Args:
      parts: shards per block of arenas, which are looked at together.
    """
    waiting: dict[int, pl.DataFrame] = {}
    turn = 0

    def judge(number: int, frame: pl.DataFrame) -> bool:
        nonlocal turn
        if enough is never:
            return False
        waiting[number] = frame
        while all(turn + part in waiting for part in range(parts)):
            block = pl.concat([waiting.pop(turn + part) for part in range(parts)])
            turn += parts
            if enough(block):
                return True
        return False

    return judge


def shard_rows(config: StudyConfig, points: Sequence[Point], *, swept: bool = False) -> list[int]:
    """Number of rows of each shard, by its number."""
    groups = groups_of(config, points)
    return [groups[shard.group].rows(shard) for shard in shards(config, len(groups), swept=swept)]


def table(points: Sequence[Point]) -> pl.DataFrame:
    """Sweep points in their stored form (`store.read_points`)."""
    names = list(points[0].values)
    columns = {name: [float(point.values[name]) for point in points] for name in names}
    return pl.DataFrame(
        {"point": [point.index for point in points], **columns},
        schema={"point": pl.Int32, **dict.fromkeys(names, pl.Float64)},
    )
