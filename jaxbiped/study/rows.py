"""Rows of missions: how they ended, and how they could have ended with perfect knowledge."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import polars as pl
from jaxtyping import Int

from jaxbiped.arenas.arena import Arena
from jaxbiped.mission.batched_driver import Result
from jaxbiped.mission.oracle import OraclePlan
from jaxbiped.mission.outcome import Code
from jaxbiped.statistics.schema import SCHEMA
from jaxbiped.study.batching import Group

LABELS = np.array([code.label for code in Code if code != Code.RUNNING])  # by code


def frame(
    index: Int[np.ndarray, "A"],
    batch: Arena,
    group: Group,
    families: Sequence[str],
    result: Result,
    plan: OraclePlan,
) -> pl.DataFrame:
    """Rows of all points and strategies on arenas `index`, the first ones of the batch, which is on the host.

    Args:
      families: the family name of each arena.
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
