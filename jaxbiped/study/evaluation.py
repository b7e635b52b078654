"""Missions on many arenas: from a study's config to rows."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import polars as pl

from jaxbiped.arenas.arena import Arena
from jaxbiped.arenas.source import name_of
from jaxbiped.core.sizes import ARENAS, POINTS, fill_up, filled
from jaxbiped.devices import by_rows, cores, mesh_of
from jaxbiped.jax_settings import with_own_settings
from jaxbiped.mission.arena_batch import draw
from jaxbiped.mission.batched_driver import OnProgress, Tally
from jaxbiped.mission.oracle import OraclePlan, oracle_plan
from jaxbiped.statistics.schema import SCHEMA
from jaxbiped.study.batching import Group, Point, Shard, groups_of, shards
from jaxbiped.study.config import StudyConfig
from jaxbiped.study.metric_values import check_metrics, metric_columns
from jaxbiped.study.rows import frame
from jaxbiped.study.runner import batch_driver
from jaxbiped.study.workload import Workload


@dataclass(frozen=True)
class Progress:
    """How far a study is: missions of this run, and the total to do."""

    ended: int
    reached: int
    total: int


def evaluate(
    config: StudyConfig,
    on_progress: Callable[[Progress], None] | None = None,
    *,
    points: Sequence[Point] | None = None,
    done: Collection[int] = (),
) -> Iterator[tuple[Shard, pl.DataFrame]]:
    """Rows of `schema.SCHEMA`, one frame per shard; memory does not grow with the number of arenas.

    Consumes `jax.random.key(config.seed)`.

    Args:
      points: sweep points; by default the one of `config`.
      done: numbers of shards to skip. The content of others does not depend on them.
    """
    groups = groups_of(config, points)
    left = [shard for shard in shards(config, len(groups), swept=bool(points)) if shard.number not in done]
    rows = [groups[shard.group].rows(shard) for shard in left]
    before, total = Tally(0, 0), sum(rows)
    for shard in left:
        last = [before]

        def report(tally: Tally, before: Tally = before, last: list[Tally] = last) -> None:
            last[0] = before + tally
            if on_progress:
                on_progress(Progress(last[0].ended, last[0].reached, total))

        yield shard, compute(config, groups[shard.group], shard, report)
        before = last[0]


@with_own_settings
def compute(
    config: StudyConfig,
    group: Group,
    shard: Shard,
    on_progress: OnProgress = lambda tally: None,
    workers: int | None = None,
) -> pl.DataFrame:
    """The rows of one shard: a function of config, group and shard alone, whatever was computed before, and where.

    Args:
      workers: queues that run at once, one per core; by default as many as this process may use.
    """
    # Shards are padded with arenas beyond the study, so that all shards, also of other studies, share programs.
    kind, count = group.kind, group.kind.count(shard.first, shard.count)
    index = kind.indices(shard.first, filled(min(config.shard, config.arenas), ARENAS))
    if count == 0:
        return pl.DataFrame(schema={**SCHEMA, **dict.fromkeys(group.metrics, pl.Float64)})
    size, key = len(index), jax.random.key(config.seed)
    turns = None if len(kind.places) == kind.number else jnp.asarray(kind.turns(index))
    batch, seeds = draw(key, jnp.asarray(index), kind.families, group.populations, turns)
    check_metrics(batch, group, size)
    workload = Workload(batch, seeds, group.params, count, group.spec, group.population_of)
    with batch_driver(group, workers or cores()) as play:
        result = play(workload, on_progress)
    batch = jax.device_get(batch)  # slicing arrays on a device would be compiled, slice by slice
    plan = plan_all(batch, group, size)
    families = [kind.families[turn] for turn in kind.turns(index[:count])]
    rows = frame(index[:count], batch, group, list(map(name_of, families)), result, plan)
    return rows.with_columns(**metric_columns(batch, group, result, plan, size))


@with_own_settings
def plan_all(batch: Arena, group: Group, size: int) -> OraclePlan:
    """The oracle plans of all points [P * S] on the arenas [A] of their populations, all on the host."""
    kinds = len(group.population_of)
    out = OraclePlan(np.zeros((kinds, size), bool), *(np.zeros((kinds, size), np.float32) for _ in range(2)))
    make = partial(oracle_plan, spec=group.spec)
    if len(jax.local_devices()) > 1:
        make = by_rows(oracle_plan, mesh_of(jax.local_devices()), shared=1, axis=1, spec=group.spec)
    for population in np.unique(group.population_of):
        mine = np.flatnonzero(group.population_of == population)
        arenas = jax.tree.map(lambda leaf, at=population * size: leaf[at : at + size], batch)
        params = jax.tree.map(lambda leaf, mine=mine: leaf[mine], group.params)
        several = POINTS if len(mine) == kinds else 1  # few of many populations have as many points
        plan = jax.device_get(make(arenas, fill_up(params, several)))
        for rows, found in zip(jax.tree.leaves(out), jax.tree.leaves(plan), strict=True):
            rows[mine] = found[: len(mine)]
    return out
