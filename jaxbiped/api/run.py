"""The functions of a sweep script that evaluate studies, and load them again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import polars as pl

from jaxbiped.api.registration import named
from jaxbiped.api.results import Results
from jaxbiped.api.study import Study
from jaxbiped.errors import InputError
from jaxbiped.mission.strategies import Strategy
from jaxbiped.planning.planners import Planner
from jaxbiped.study import store
from jaxbiped.study.evaluation import Progress
from jaxbiped.study.evaluation import evaluate as evaluate_shards
from jaxbiped.study.run_study import Engine, compute_study, table
from jaxbiped.study.runner import check_mission


def evaluate(
    study: Study, out: str | Path | None = None, on_progress: Callable[[Progress], None] | None = None
) -> Results:
    """Play every strategy on every arena of a study.

    Args:
      out: folder to store the rows in, shard by shard; by default they are only kept in memory (see `Results.save`).
        A study that was stopped there is resumed.
      on_progress: called from time to time.

    Raises:
      InputError: something that cannot run on this machine, or a folder that holds something else.
    """
    return _evaluated(study, None, out, on_progress)


def sweep(
    study: Study,
    axes: Mapping[str, Sequence[float | int]],
    out: str | Path | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> Results:
    """Evaluate a study at every combination of values: `{"costs.c3": [2, 5, 10], "planner.clearance": [0, 0.1]}`.

    Args:
      axes: dotted fields of the mission's config, `population.<field>`, or `planner.<field>`, `sensor.<field>` and
        `executor.<field>` of your own.
      out, on_progress: as for `evaluate`.

    Raises:
      InputError: as for `evaluate`; a field that does not exist, or a value that it does not allow.
    """
    if not axes:
        raise InputError("must name at least one field", field="axes")
    return _evaluated(study, dict(axes), out, on_progress)


def _evaluated(study: Study, axes, out, on_progress) -> Results:
    config = study.config(axes)
    points = tuple(config.points()) if axes else None
    for mission in {point.mission for point in points} if points else {config.mission}:
        check_mission(mission)
    if out is not None:
        engine = Engine(on_progress=on_progress)
        compute_study(out, config, points=points, resume=Path(out).exists(), engine=engine)
        return load(out, own=study.own)
    frames = [frame for _, frame in evaluate_shards(config, on_progress, points=points)]
    swept = table(points) if points else pl.DataFrame({"point": [0]}, schema={"point": pl.Int32})
    return Results.of(pl.concat(frames), swept, config, study.own)


def load(folder: str | Path, own: Sequence[Strategy | Planner] = ()) -> Results:
    """The results that a study stored in a folder, from Python or the command line; nothing is imported by name.

    Args:
      own: strategies of the study that are not built in, needed to replay their missions.

    Raises:
      InputError: not a results folder, or a damaged one.
    """
    frame, manifest = store.read(folder)
    return Results(
        rows=frame,
        points=store.read_points(folder),
        config=manifest.config,
        folder=Path(folder),
        own=tuple(map(named, own)),
        shown=manifest.metrics,
    )
