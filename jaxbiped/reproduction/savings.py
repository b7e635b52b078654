"""The population behind the paper's example: what crossing bumps saves on many random arenas."""

from __future__ import annotations

import math
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
import polars as pl
from jaxtyping import Int

from jaxbiped.mission.arena_batch import draw
from jaxbiped.mission.params import MissionConfig
from jaxbiped.motion.grid_units import CELL
from jaxbiped.reproduction.paper import TABLE_2
from jaxbiped.statistics.comparison import ALL, Comparison, PairComparison, compare
from jaxbiped.study.config import StudyConfig

CROSSES, GOES_ROUND = "full", "floor_only"
FAMILY = "bump"


@dataclass(frozen=True)
class Population:
    """Both strategies on the same arenas."""

    executor: str
    sensor: str
    arenas: int
    comparison: Comparison
    both: pl.DataFrame  # arenas that both solved: saved_distance [m], saved_time [s], width, detour [m], crosses
    always: pl.DataFrame | None = None  # the same for a robot that steps over bumps as if they were floor

    @property
    def pair(self) -> PairComparison:
        """The comparison over all arenas."""
        return self.comparison.pair(CROSSES, GOES_ROUND, ALL)

    def percentile(self, column: str, value: float) -> float:
        """Share of the arenas that saved less than a value, with ties counted half."""
        saved = self.both[column].to_numpy()
        return float(((saved < value).mean() + (saved <= value).mean()) / 2) if len(saved) else float("nan")

    @property
    def tried(self) -> pl.DataFrame:
        """The best data on where crossing pays: those of a robot that always crosses, if there is one."""
        return self.both if self.always is None else self.always


def study(arenas: int, seed: int, executor: str) -> StudyConfig:
    """The study to run."""
    mission = MissionConfig(executor=executor, sensor="raycast")
    return StudyConfig(seed=seed, arenas=arenas, families=(FAMILY,), strategies=(CROSSES, GOES_ROUND), mission=mission)


def always(config: StudyConfig) -> StudyConfig:
    """The same arenas for a robot that crosses whenever that is shorter: a step costs as much as floor, C3 = C1."""
    costs = config.mission.costs.model_copy(update={"c3": config.mission.costs.c1})
    mission = config.mission.model_copy(update={"costs": costs})
    return config.model_copy(update={"strategies": (CROSSES,), "mission": mission})


def population(
    frame: pl.DataFrame, config: StudyConfig, measure: float, crossing: pl.DataFrame | None = None
) -> Population:
    """The population of a study's rows.

    Args:
      frame: rows of `schema.SCHEMA`, timed by the config's durations.
      measure: [s] duration of a measurement, to recompute times; no decision depends on it.
      crossing: rows of `always`.
    """
    more = measure - config.mission.durations.measure
    frame = timed(frame, more)
    sides = {name: frame.filter(strategy=name) for name in (CROSSES, GOES_ROUND)}
    solved = saved(sides[CROSSES], sides[GOES_ROUND], config)
    tried = None if crossing is None else saved(timed(crossing, more), sides[GOES_ROUND], config)
    comparison = compare(frame, pairs=[(CROSSES, GOES_ROUND)], seed=config.seed)
    return Population(config.mission.executor, config.mission.sensor, config.arenas, comparison, solved, tried)


def timed(frame: pl.DataFrame, more: float) -> pl.DataFrame:
    """Rows with this many additional seconds for each measurement."""
    return frame.with_columns(
        [(pl.col(name) + pl.col("measurements") * more).cast(pl.Float64) for name in ("time", "elapsed")]
    )


def saved(over: pl.DataFrame, round_it: pl.DataFrame, config: StudyConfig) -> pl.DataFrame:
    """The savings of the first on the arenas that both solved."""
    both = over.join(round_it, on="arena", suffix="_round").sort("arena")
    both = both.join(measures(both["arena"].to_numpy(), config), on="arena")
    return both.filter(pl.col("success") & pl.col("success_round")).select(
        "arena",
        "width",
        "straight",
        saved_distance=pl.col("distance_round") - pl.col("distance"),
        saved_time=pl.col("time_round") - pl.col("time"),
        detour=pl.col("oracle_length_round") - pl.col("straight"),
        crosses=pl.col("oracle_cost") < pl.col("oracle_cost_round") - 1e-3,
    )


def measures(arenas: Int[np.ndarray, "n"], config: StudyConfig) -> pl.DataFrame:
    """Width of the bump along the path, and the straight distance from start to goal, of each arena [m]."""
    index = jnp.asarray(arenas, jnp.int32)
    batch, _ = jax.device_get(draw(jax.random.key(config.seed), index, config.families))
    away = batch.goal_xy - batch.start_xyyaw[:, :2]
    return pl.DataFrame(
        {
            "arena": arenas.astype(np.int64),
            "width": 2 * batch.boxes.half_x[:, 0].astype(float),
            "straight": np.hypot(away[:, 0], away[:, 1]).astype(float),
        }
    )


def break_even(measure: float) -> float:
    """[m] Detour above which stepping over two edges is faster, by Table 2 alone."""
    extra = TABLE_2.step_up + TABLE_2.step_down - 2 * TABLE_2.straight
    return CELL * extra / (TABLE_2.straight + measure)


@dataclass(frozen=True)
class BreakEven:
    """The detour [m] at which crossing takes as long as walking around, for a bump of some width [m]."""

    width: float
    detour: float
    low: float
    high: float
    arenas: int


def measured_break_even(frame: pl.DataFrame, seed: int = 0, resamples: int = 999) -> BreakEven | None:
    """Where a plane, saved time over width and detour, is zero at the median width; percentiles of a bootstrap at 95 %.

    Args:
      frame: `Population.tried`.

    Returns:
      None for fewer than ten arenas where crossing the bump is cheaper, or if time does not increase with detour.
    """
    crossed = frame.filter("crosses")
    if len(crossed) < 10:
        return None
    rows, time = crossed.select(pl.lit(1.0), "width", "detour").to_numpy(), crossed["saved_time"].to_numpy()
    width = float(np.median(rows[:, 1]))

    def zero(chosen: Int[np.ndarray, "n"]) -> float:
        a, b, c = np.linalg.lstsq(rows[chosen], time[chosen], rcond=None)[0]
        return float(-(a + b * width) / c) if c > 0 else math.nan

    rng, n = np.random.default_rng(seed), len(rows)
    found = zero(np.arange(n))
    if not math.isfinite(found):
        return None
    low, high = np.nanquantile([zero(rng.integers(n, size=n)) for _ in range(resamples)], [0.025, 0.975])
    return BreakEven(width, found, float(low), float(high), n)
