"""The population behind the paper's example: what crossing bumps saves on many random arenas."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
import polars as pl
from jaxtyping import Int

from jaxbiped.mission.settings import MissionConfig
from jaxbiped.motion.primitives import CELL
from jaxbiped.study.comparison import ALL, Comparison, PairComparison, compare
from jaxbiped.study.config import StudyConfig
from jaxbiped.study.evaluate import draw
from jaxbiped.study.reproduction.paper import TABLE_2

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

    @property
    def pair(self) -> PairComparison:
        """Over all arenas."""
        return self.comparison.pair(CROSSES, GOES_ROUND, ALL)

    def percentile(self, column: str, value: float) -> float:
        """Share of the arenas that saved less than a value, those that saved as much counted half."""
        saved = self.both[column].to_numpy()
        return float(((saved < value).mean() + (saved <= value).mean()) / 2) if len(saved) else float("nan")


def study(arenas: int, seed: int, executor: str) -> StudyConfig:
    """What is run."""
    mission = MissionConfig(executor=executor, sensor="raycast")
    return StudyConfig(seed=seed, arenas=arenas, families=(FAMILY,), strategies=(CROSSES, GOES_ROUND), mission=mission)


def population(frame: pl.DataFrame, config: StudyConfig, measure: float) -> Population:
    """The population of a study's rows.

    Args:
      frame: rows of `schema.SCHEMA`, timed by the config's durations.
      measure: [s] of a measurement to tell times with instead; no decision depends on it.
    """
    more = measure - config.mission.durations.measure
    times = [(pl.col(name) + pl.col("measurements") * more).cast(pl.Float32) for name in ("time", "elapsed")]
    frame = frame.with_columns(times)
    sides = {name: frame.filter(strategy=name).sort("arena") for name in (CROSSES, GOES_ROUND)}
    both = sides[CROSSES].join(sides[GOES_ROUND], on="arena", suffix="_round").sort("arena")
    both = both.join(measures(both["arena"].to_numpy(), config), on="arena")
    solved = both.filter(pl.col("success") & pl.col("success_round")).select(
        "arena",
        "width",
        "straight",
        saved_distance=pl.col("distance_round") - pl.col("distance"),
        saved_time=pl.col("time_round") - pl.col("time"),
        detour=pl.col("oracle_length_round") - pl.col("straight"),
        crosses=pl.col("oracle_cost") < pl.col("oracle_cost_round") - 1e-3,
    )
    comparison = compare(frame, pairs=[(CROSSES, GOES_ROUND)], seed=config.seed)
    return Population(config.mission.executor, config.mission.sensor, config.arenas, comparison, solved)


def measures(arenas: Int[np.ndarray, "n"], config: StudyConfig) -> pl.DataFrame:
    """Width of the bump along the way, and the straight distance from start to goal, of each arena [m]."""
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
    """[m] of detour from which on stepping over two edges is faster, by Table 2 alone."""
    extra = TABLE_2.step_up + TABLE_2.step_down - 2 * TABLE_2.straight
    return CELL * extra / (TABLE_2.straight + measure)
