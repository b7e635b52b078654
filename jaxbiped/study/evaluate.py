"""Missions on many arenas: from a study's config to rows."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Literal

import jax
import jax.numpy as jnp
import numpy as np
import polars as pl
import pydantic
import tyro
from jaxtyping import Array, Int, PRNGKeyArray, UInt32

from jaxbiped import arenas as arena_room
from jaxbiped.arenas.arena import Arena
from jaxbiped.arenas.families import SIZE_X, SIZE_Y
from jaxbiped.config import Model
from jaxbiped.mission.oracle import OraclePlan, oracle_plan
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.queue import SLOTS, Jobs, Result, compile_queue, stack
from jaxbiped.mission.settings import SIMULATED, MissionConfig, Program, Settings, program
from jaxbiped.sensing.hashing import from_key
from jaxbiped.study.schema import FAMILIES, SCENE, SCHEMA, STRATEGIES

NOISE = 1  # fold_in of an arena's key, for the noise of its missions
WORKERS = 2  # queues worked off at once, a core each

Family = Literal[FAMILIES]
StrategyName = Literal[STRATEGIES]


class StudyConfig(Model):
    """Strategies compared on the same random arenas."""

    seed: Annotated[int, pydantic.Field(ge=0, lt=2**32)] = 0
    """Arena k and its noise are functions of this seed and of k alone."""
    arenas: Annotated[int, pydantic.Field(ge=1, le=100_000_000)] = 600
    families: Annotated[tuple[Family, ...], pydantic.Field(min_length=1)] = FAMILIES
    """They take turns: arena k is of family k modulo their number."""
    strategies: Annotated[tuple[StrategyName, ...], pydantic.Field(min_length=1)] = STRATEGIES
    shard: Annotated[int, pydantic.Field(ge=1, le=65536)] = 1024
    """Arenas that are computed, and written, together."""
    mission: Annotated[MissionConfig, tyro.conf.arg(name="")] = MissionConfig()

    @pydantic.model_validator(mode="after")
    def _distinct(self):
        for name in ("families", "strategies"):
            if len(set(getattr(self, name))) < len(getattr(self, name)):
                raise ValueError(f"{name} must be named once each")
        return self


@dataclass(frozen=True)
class Progress:
    """How far a study is."""

    ended: int  # missions
    total: int


def evaluate(config: StudyConfig, on_progress: Callable[[Progress], None] | None = None) -> Iterator[pl.DataFrame]:
    """Rows of `schema.SCHEMA`, a frame for each shard of arenas; memory does not grow with the number of arenas.

    Consumes `jax.random.key(config.seed)`.
    """
    key = jax.random.key(config.seed)
    points = stack([config.mission.settings(name) for name in config.strategies])
    static = program(config.mission, (SIZE_X, SIZE_Y))
    size = min(config.shard, config.arenas)
    total = config.arenas * len(config.strategies)
    for first in range(0, config.arenas, size):
        count = min(size, config.arenas - first)
        # The last shard is filled up with arenas beyond the study, so that all shards share one program.
        batch, seeds = draw(key, first + jnp.arange(size), config.families)
        before = first * len(config.strategies)

        def report(ended: int, before: int = before) -> None:
            if on_progress:
                on_progress(Progress(before + ended, total))

        play = run_all
        if static.executor in SIMULATED:
            from jaxbiped.study.walks import walk_all  # loads MuJoCo

            play = partial(walk_all, config=config.mission.walk)
        result = play(batch, seeds, points, count, static, report)
        plan = oracle_plan(batch, points, static)
        index = np.arange(first, first + count)
        yield frame(index, batch, config.strategies, result, plan, count)


@partial(jax.jit, static_argnames=("families",))
def draw(key: PRNGKeyArray, index: Int[Array, "A"], families: tuple[str, ...]) -> tuple[Arena, UInt32[Array, "A"]]:
    """Arenas `index` of the population, and the seeds of their missions' noise: the same for all strategies."""
    batch = jax.vmap(partial(arena_room.sample, key, families=families))(index)
    seeds = jax.vmap(lambda k: from_key(jax.random.fold_in(jax.random.fold_in(key, k), NOISE)))(index)
    return batch, seeds


def run_all(
    batch: Arena,
    seeds: UInt32[Array, "A"],
    points: Settings,
    count: int,
    static: Program,
    on_progress: Callable[[int], None],
    workers: int = WORKERS,
    slots: int = SLOTS,
) -> Result:
    """Every arena under every point: results [P, count], on the host.

    Jobs are dealt to as many queues as there are workers. Which queue a job is in does not change its result.
    """
    size, kinds = seeds.shape[0], jax.tree.leaves(points)[0].shape[0]
    arena, point = (grid.ravel() for grid in np.meshgrid(np.arange(size), np.arange(kinds)))
    real = arena < count
    arena, point = np.concatenate([arena[real], arena[~real]]), np.concatenate([point[real], point[~real]])
    workers = max(1, min(workers, count * kinds))
    length = -(-size * kinds // workers)
    hands = []
    for worker in range(workers):
        mine = np.arange(worker, size * kinds, workers)
        mine = np.concatenate([mine, np.zeros(length - len(mine), int)])
        active = len(range(worker, count * kinds, workers))
        jobs = Jobs(jnp.asarray(arena[mine]), jnp.asarray(point[mine]), seeds[arena[mine]], jnp.int32(active))
        hands.append(jobs)
    work = compile_queue(batch, points, hands[0], static, min(slots, length))
    ended, lock = [0] * workers, threading.Lock()

    stop = threading.Event()

    def play(worker: int) -> Result:
        def tell(done: int) -> None:
            if stop.is_set():
                raise InterruptedError
            with lock:
                ended[worker] = done
                on_progress(sum(ended))

        return jax.device_get(work(batch, points, hands[worker], tell))

    with ThreadPoolExecutor(workers) as pool:
        try:
            results = list(pool.map(play, range(workers)))
        except BaseException:
            stop.set()  # an interrupt shall not wait for the whole shard
            raise
    out = jax.tree.map(lambda leaf: np.zeros((kinds, count), leaf.dtype), results[0])
    for worker, result in enumerate(results):
        mine = np.arange(worker, count * kinds, workers)
        for all_rows, rows in zip(jax.tree.leaves(out), jax.tree.leaves(result), strict=True):
            all_rows[point[mine], arena[mine]] = rows[: len(mine)]
    return out


def frame(
    index: Int[np.ndarray, "A"],
    batch: Arena,
    strategies: Sequence[str],
    result: Result,
    plan: OraclePlan,
    count: int,
) -> pl.DataFrame:
    """Rows of all strategies on `count` arenas."""
    plan, family, difficulty = jax.device_get((plan, batch.family, batch.difficulty))
    names = np.array([*FAMILIES, SCENE])[family[:count]]
    frames = []
    for p, name in enumerate(strategies):
        reached = result.code[p] == Code.REACHED
        walked, elapsed = result.distance[p].astype(float), result.time[p].astype(float)
        reachable = plan.reachable[p, :count]
        columns = {
            "point": np.zeros(count, np.int32),
            "arena": index,
            "family": names,
            "difficulty": difficulty[:count],
            "strategy": [name] * count,
            "code": [Code(int(code)).label for code in result.code[p]],
            "success": reached,
            "distance": masked(walked, reached),
            "time": masked(elapsed, reached),
            "walked": walked,
            "elapsed": elapsed,
            "measurements": result.measurements[p],
            "decisions": result.decisions[p],
            "goal_distance": result.goal_distance[p].astype(float),
            "reachable": reachable,
            "oracle_cost": masked(plan.cost[p, :count].astype(float), reachable),
            "oracle_length": masked(
                plan.length[p, :count].astype(float), reachable & np.isfinite(plan.length[p, :count])
            ),
        }
        frames.append(pl.DataFrame(columns, schema=SCHEMA))
    return pl.concat(frames)


def masked(values: np.ndarray, valid: np.ndarray) -> pl.Series:
    """A column that is null where it is not valid."""
    return pl.DataFrame({"value": values, "valid": valid}).select(pl.when("valid").then("value")).to_series()


class CompileClock:
    """Seconds that this process has spent compiling, by JAX's own count."""

    EVENTS = (
        "/jax/core/compile/jaxpr_trace_duration",
        "/jax/core/compile/jaxpr_to_mlir_module_duration",
        "/jax/core/compile/backend_compile_duration",
    )

    def __init__(self):
        self.seconds = 0.0
        jax.monitoring.register_event_duration_secs_listener(self.listen)

    def listen(self, event: str, duration: float, **_: object) -> None:
        if event in self.EVENTS:
            self.seconds += duration


def stopwatch() -> Callable[[], float]:
    """Seconds since the call."""
    start = time.perf_counter()
    return lambda: time.perf_counter() - start
