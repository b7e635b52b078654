"""Missions on many arenas: from a study's config to rows."""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import polars as pl
from jaxtyping import Array, Int, PRNGKeyArray, UInt32

from jaxbiped.arenas.arena import Arena
from jaxbiped.arenas.population import Population
from jaxbiped.arenas.source import OwnFamily, draw_arena, name_of
from jaxbiped.core.ready_programs import ready_jit
from jaxbiped.core.sizes import ARENAS, JOBS, POINTS, fill, filled
from jaxbiped.devices import by_rows, cores, mesh_of
from jaxbiped.jax_settings import with_own_settings
from jaxbiped.mission.oracle import OraclePlan, oracle_plan
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.queue import (
    SLOTS,
    Jobs,
    OnProgress,
    Result,
    Tally,
    Work,
    compile_queue,
    stack,
)
from jaxbiped.mission.settings import Program, Settings
from jaxbiped.sensing.hashing import from_key
from jaxbiped.study.config import StudyConfig
from jaxbiped.study.groups import Group, Point, Shard, groups_of, shards
from jaxbiped.study.metric_columns import check_metrics, metric_columns
from jaxbiped.study.runner import batch_driver
from jaxbiped.study.schema import SCHEMA

NOISE = 1  # fold_in of an arena's key, for the noise of its missions
LABELS = np.array([code.label for code in Code if code != Code.RUNNING])  # by code


@dataclass(frozen=True)
class Progress:
    """How far a study is: missions of this run, and all that it has to do."""

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
    """Rows of `schema.SCHEMA`, a frame for each shard; memory does not grow with the number of arenas.

    Consumes `jax.random.key(config.seed)`.

    Args:
      points: sweep points; by default the one of `config`.
      done: numbers of shards to leave out. What others hold does not depend on them.
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
      workers: queues worked off at once, a core each; by default as many as this process may use.
    """
    # Shards are filled up with arenas beyond the study, so that all of them, and those of others, share programs.
    kind, count = group.kind, group.kind.count(shard.first, shard.count)
    index = kind.indices(shard.first, filled(min(config.shard, config.arenas), ARENAS))
    if count == 0:
        return pl.DataFrame(schema={**SCHEMA, **dict.fromkeys(group.metrics, pl.Float64)})
    size, key = len(index), jax.random.key(config.seed)
    turns = None if len(kind.places) == kind.number else jnp.asarray(kind.turns(index))
    batch, seeds = draw(key, jnp.asarray(index), kind.families, group.populations, turns)
    check_metrics(batch, group, size)
    with batch_driver(group, workers or cores()) as play:
        result = play(batch, seeds, group.settings, count, group.static, on_progress, population_of=group.population_of)
    batch = jax.device_get(batch)  # slices of arrays on a device would be compiled, one by one
    plan = plan_all(batch, group, size)
    families = [kind.families[turn] for turn in kind.turns(index[:count])]
    rows = frame(index[:count], batch, group, list(map(name_of, families)), result, plan)
    return rows.with_columns(**metric_columns(batch, group, result, plan, size))


@with_own_settings
@ready_jit(static_argnames=("families",))
def draw(
    key: PRNGKeyArray,
    index: Int[Array, "A"],
    families: tuple[str | OwnFamily, ...],
    populations: Population | None = None,
    turns: Int[Array, "A"] | None = None,
) -> tuple[Arena, UInt32[Array, "A"]]:
    """Arenas `index` of the population, and the seeds of their missions' noise: the same for all strategies.

    Args:
      populations: leaves [U]; the arenas are then those of each of them, one after the other: [U * A].
      turns: which of the families each is; by default its number modulo theirs.
    """

    def one(population: Population | None) -> Arena:
        if turns is None:
            return jax.vmap(lambda k: draw_arena(key, k, families, population))(index)
        return jax.vmap(lambda k, turn: draw_arena(key, k, families, population, turn))(index, turns)

    if populations is None:
        batch = one(None)
    else:
        batch = jax.tree.map(lambda leaf: leaf.reshape(-1, *leaf.shape[2:]), jax.vmap(one)(populations))
    seeds = jax.vmap(lambda k: from_key(jax.random.fold_in(jax.random.fold_in(key, k), NOISE)))(index)
    return batch, seeds


@with_own_settings
def run_all(
    batch: Arena,
    seeds: UInt32[Array, "A"],
    points: Settings,
    count: int,
    static: Program,
    on_progress: OnProgress,
    workers: int | None = None,
    slots: int = SLOTS,
    population_of: Int[np.ndarray, "P"] | None = None,
    devices: Sequence[jax.Device] | None = None,
) -> Result:
    """The first `count` arenas under every point: results [P, count], on the host.

    Jobs are dealt to as many queues as there are devices, or to as many as there are workers where there is one device.
    Which queue a job is in does not change its result.

    Args:
      batch: [A], or [U * A] where there are `U` populations.
      workers: by default as many as this process may use cores.
      slots: of each queue. XLA fuses a program by its sizes, and what it fuses otherwise may round otherwise: rows are
        the same, bit for bit, among runs of as many slots, so that few jobs have as many as many do.
      population_of: which of these each point is about; by default the first.
      devices: by default all of this process.
    """
    size, kinds = seeds.shape[0], jax.tree.leaves(points)[0].shape[0]
    block = size * (np.zeros(kinds, int) if population_of is None else population_of)
    arena, point = (grid.ravel() for grid in np.meshgrid(np.arange(size), np.arange(kinds)))
    real = arena < count
    arena, point = np.concatenate([arena[real], arena[~real]]), np.concatenate([point[real], point[~real]])
    devices = devices or jax.local_devices()
    queues = len(devices) if len(devices) > 1 else max(1, min(workers or cores(), count * kinds))
    length = filled(-(-size * kinds // queues), JOBS)
    batch, points = fill_up(batch, ARENAS), fill_up(points, POINTS)
    hands = []
    for number in range(queues):
        mine = np.arange(number, size * kinds, queues)
        mine = np.concatenate([mine, np.zeros(length - len(mine), int)])
        active = len(range(number, count * kinds, queues))
        place = jnp.asarray(arena[mine] + block[point[mine]])
        jobs = Jobs(place, jnp.asarray(point[mine]), seeds[arena[mine]], jnp.int32(active))
        hands.append(jobs)
    if len(devices) > 1:
        jobs, mesh = stack(hands), mesh_of(devices)
        result = jax.device_get(
            compile_queue(batch, points, jobs, static, slots, mesh)(batch, points, jobs, on_progress)
        )
        results = [jax.tree.map(lambda leaf, number=number: leaf[number], result) for number in range(queues)]
    else:
        results = run_threads(compile_queue(batch, points, hands[0], static, slots), batch, points, hands, on_progress)
    out = jax.tree.map(lambda leaf: np.zeros((kinds, count), leaf.dtype), results[0])
    for number, result in enumerate(results):
        mine = np.arange(number, count * kinds, queues)
        for all_rows, rows in zip(jax.tree.leaves(out), jax.tree.leaves(result), strict=True):
            all_rows[point[mine], arena[mine]] = rows[: len(mine)]
    return out


def fill_up(tree, least: int):
    """The leaves with as many rows as a program is compiled for, on the host."""
    return fill(tree, filled(jax.tree.leaves(tree)[0].shape[0], least))


def run_threads(
    work: Work, batch: Arena, points: Settings, hands: Sequence[Jobs], on_progress: OnProgress
) -> list[Result]:
    """Work off queues at once, a thread each."""
    tallies, lock = [Tally(0, 0)] * len(hands), threading.Lock()
    stop = threading.Event()

    def play(number: int) -> Result:
        def tell(tally: Tally) -> None:
            if stop.is_set():
                raise InterruptedError
            with lock:
                tallies[number] = tally
                on_progress(sum(tallies, Tally(0, 0)))

        return jax.device_get(work(batch, points, hands[number], tell))

    with ThreadPoolExecutor(len(hands)) as pool:
        try:
            return list(pool.map(play, range(len(hands))))
        except BaseException:
            stop.set()  # an interrupt shall not wait for the whole shard
            raise


@with_own_settings
def plan_all(batch: Arena, group: Group, size: int) -> OraclePlan:
    """The oracle plans of all points [P * S] on the arenas [A] of their populations, all on the host."""
    kinds = len(group.population_of)
    out = OraclePlan(np.zeros((kinds, size), bool), *(np.zeros((kinds, size), np.float32) for _ in range(2)))
    make = partial(oracle_plan, program=group.static)
    if len(jax.local_devices()) > 1:
        make = by_rows(oracle_plan, mesh_of(jax.local_devices()), shared=1, axis=1, program=group.static)
    for population in np.unique(group.population_of):
        mine = np.flatnonzero(group.population_of == population)
        arenas = jax.tree.map(lambda leaf, at=population * size: leaf[at : at + size], batch)
        settings = jax.tree.map(lambda leaf, mine=mine: leaf[mine], group.settings)
        plan = jax.device_get(make(arenas, fill_up(settings, POINTS)))
        for rows, found in zip(jax.tree.leaves(out), jax.tree.leaves(plan), strict=True):
            rows[mine] = found[: len(mine)]
    return out


def frame(
    index: Int[np.ndarray, "A"],
    batch: Arena,
    group: Group,
    families: Sequence[str],
    result: Result,
    plan: OraclePlan,
) -> pl.DataFrame:
    """Rows of all points and strategies on arenas `index`, the first of the batch, which is on the host.

    Args:
      families: the name of each arena's.
    """
    count, kinds, strategies = len(index), len(group.population_of), group.strategies
    family, difficulty = np.array(families, str), batch.difficulty[:count]
    reached = result.code == Code.REACHED
    reachable, cost, length = (values[:, :count] for values in (plan.reachable, plan.cost, plan.length))
    columns = {
        "point": np.repeat(group.points, len(strategies) * count),
        "arena": np.tile(index, kinds),
        "family": np.tile(family, kinds),
        "difficulty": np.tile(difficulty, kinds),
        "strategy": np.tile(np.repeat(strategies, count), len(group.points)),
        "code": LABELS[result.code],
        "success": reached,
        "distance": masked(result.distance, reached),
        "time": masked(result.time, reached),
        "walked": result.distance,
        "elapsed": result.time,
        "measurements": result.measurements,
        "decisions": result.decisions,
        "goal_distance": result.goal_distance,
        "pose_error": result.pose_error,
        "yaw_error": result.yaw_error,
        "reachable": reachable,
        "oracle_cost": masked(cost, reachable),
        "oracle_length": masked(length, reachable & np.isfinite(length)),
        "planning_calls": result.planned.calls,
        "planning_time": masked(result.planned.seconds, np.isfinite(result.planned.seconds)),
        "plan_cost": masked(result.planned.cost, np.isfinite(result.planned.cost)),
    }
    flat = {name: column.ravel() if isinstance(column, np.ndarray) else column for name, column in columns.items()}
    return pl.DataFrame(flat, schema_overrides={"point": pl.Int32}).cast(dict(SCHEMA))


def masked(values: np.ndarray, valid: np.ndarray) -> pl.Series:
    """A column that is null where it is not valid."""
    return (
        pl.DataFrame({"value": values.ravel(), "valid": valid.ravel()})
        .select(pl.when("valid").then("value"))
        .to_series()
    )
