"""The row of a study: one for each sweep point, arena and strategy."""

from __future__ import annotations

import re
from collections.abc import Iterable

import polars as pl

from jaxbiped.core.names import CODES as CODES
from jaxbiped.core.names import FAMILIES as FAMILIES
from jaxbiped.core.names import KNOWN as KNOWN
from jaxbiped.core.names import MOVING as MOVING
from jaxbiped.core.names import REACHED as REACHED
from jaxbiped.core.names import SCENE as SCENE
from jaxbiped.core.names import STRATEGIES as STRATEGIES
from jaxbiped.errors import InputError

FAMILY_NAME = r"^[\w][\w .+-]{0,79}$"
STRATEGY_NAME = r"^[A-Za-z][\w .+-]{0,39}$"
KEY = ("point", "arena", "strategy")

SCHEMA = pl.Schema(
    {
        "point": pl.Int32,  # sweep point, 0 in a comparison
        "arena": pl.Int64,  # k of fold_in(key(seed), k): pairs the strategies
        "family": pl.String,  # its name
        "difficulty": pl.Float32,  # 0 (easy) to 1 (hard)
        "strategy": pl.String,  # its name
        "code": pl.String,  # one of CODES: how the mission ended
        "success": pl.Boolean,  # code == REACHED
        "distance": pl.Float64,  # [m] walked; null unless reached
        "time": pl.Float64,  # [s] taken; null unless reached
        "walked": pl.Float64,  # [m] walked, however the mission ended
        "elapsed": pl.Float64,  # [s] taken, however the mission ended
        "measurements": pl.Int32,
        "decisions": pl.Int32,
        "goal_distance": pl.Float64,  # [m] distance from the goal at the end
        "pose_error": pl.Float64,  # [m] distance from the believed position at the end
        "yaw_error": pl.Float64,  # [rad] the same for yaw, 0 to pi
        "reachable": pl.Boolean,  # a plan exists for this strategy with perfect knowledge (the oracle plan)
        "oracle_cost": pl.Float64,  # that plan's cost; null where there is none
        "oracle_length": pl.Float64,  # [m] that plan's length; null where there is none
        "planning_calls": pl.Int32,  # number of plans made
        "planning_time": pl.Float64,  # [s] spent on them; null inside a compiled program, where it cannot be measured
        "plan_cost": pl.Float64,  # cost of the first path found, by Eq. 1; null if not known
    }
)
METRIC_NAME = r"^[a-z][a-z0-9_]{0,39}$"  # columns of metrics, which follow the schema's columns: Float64, or null
ADDED = ("planning_calls", "planning_time", "plan_cost")  # null in rows of older versions
NULLABLE = ("distance", "time", "oracle_cost", "oracle_length", *ADDED)


def ordered_families(names: Iterable[str]) -> tuple[str, ...]:
    """Names of families in the order of every table and figure: built-in ones, then the others."""
    names, usual = set(names), (*KNOWN, SCENE)
    return (*(name for name in usual if name in names), *sorted(names - set(usual)))


def ordered(names: Iterable[str]) -> tuple[str, ...]:
    """Names of strategies in the order of every table and figure: built-in ones, then the others."""
    names = set(names)
    return (*(name for name in STRATEGIES if name in names), *sorted(names - set(STRATEGIES)))


def validate(frame: pl.DataFrame, *, file: object = None) -> pl.DataFrame:
    """The frame with its columns in the schema's order, then metrics; `InputError` about the first error.

    Checked: columns and types, named values, nulls (an invalid number is null, never NaN), that distance and time are
    present exactly for missions that reached, and that no row occurs twice. NaN is allowed only in `walked`, `elapsed`,
    `goal_distance` and the errors of a mission that ended as `invalid`.
    """
    where = {"file": str(file)} if file is not None else {}
    frame = frame.with_columns(pl.lit(None, SCHEMA[name]).alias(name) for name in ADDED if name not in frame.columns)
    for name, dtype in SCHEMA.items():
        if name not in frame.columns:
            raise InputError(f"column missing; rows have {', '.join(SCHEMA)}", field=name, **where)
        if frame.schema[name] != dtype:
            raise InputError(f"must be of type {dtype}", field=name, value=str(frame.schema[name]), **where)
    measured = metric_columns(frame)
    for name in frame.columns:
        if name not in SCHEMA and not (re.fullmatch(METRIC_NAME, name) and frame.schema[name] == pl.Float64):
            message = f"unknown column; rows have {', '.join(SCHEMA)}, and metrics: small letters, of type Float64"
            raise InputError(message, field=name, **where)
    for name, (wrong, allowed) in (rules() | metric_rules(measured)).items():
        bad = frame.filter(wrong)
        if len(bad):
            row = bad.row(0, named=True)
            at = f" (point {row['point']}, arena {row['arena']}, strategy {row['strategy']})"
            raise InputError(allowed + at, field=name, value=row[name], **where)
    doubled = frame.filter(pl.struct(KEY).is_duplicated())
    if len(doubled):
        raise InputError("each sweep point, arena and strategy has one row", value=doubled.select(KEY).row(0), **where)
    return frame.select(*SCHEMA.names(), *measured)


def metric_columns(frame: pl.DataFrame) -> tuple[str, ...]:
    """The columns of metrics."""
    return tuple(name for name in frame.columns if name not in SCHEMA)


def metric_rules(names: Iterable[str]) -> dict[str, tuple[pl.Expr, str]]:
    """As `rules`, for metrics."""
    return {name: (pl.col(name).is_not_null() & ~pl.col(name).is_finite(), "must be finite or null") for name in names}


def rules() -> dict[str, tuple[pl.Expr, str]]:
    """For each column: a Boolean expression over rows that finds errors, and what is allowed."""
    reached, invalid = pl.col("code") == REACHED, pl.col("code") == "invalid"
    checks = {
        "code": (~pl.col("code").is_in(CODES), f"must be one of {', '.join(CODES)}"),
        "strategy": (~pl.col("strategy").str.contains(STRATEGY_NAME), "must be the name of a strategy"),
        "family": (~pl.col("family").str.contains(FAMILY_NAME), "must be the name of a family"),
        "success": (pl.col("success") != reached, "must be true exactly where the code is reached"),
    }
    for name in ("distance", "time"):
        wrong = (pl.col(name).is_not_null() != reached) | ~pl.col(name).is_finite() | (pl.col(name) < 0)
        checks[name] = (wrong, "must be finite and not negative where the code is reached, null elsewhere")
    for name in ("walked", "elapsed", "goal_distance", "pose_error", "yaw_error"):
        wrong = ~invalid & (~pl.col(name).is_finite() | (pl.col(name) < 0))
        checks[name] = (wrong, "must be finite and not negative unless the code is invalid")
    for name in ("oracle_cost", "oracle_length"):
        wrong = pl.col(name).is_not_null() & (~pl.col("reachable") | ~pl.col(name).is_finite())
        checks[name] = (wrong, "must be finite or null, and null where the goal is not reachable")
    for name in ("planning_time", "plan_cost"):
        checks[name] = (~pl.col(name).is_finite() | (pl.col(name) < 0), "must be finite and not negative, or null")
    checks["planning_calls"] = (pl.col("planning_calls") < 0, "must not be negative")
    checks["difficulty"] = (~pl.col("difficulty").is_finite(), "must be finite")
    named = {name: checks.get(name, (pl.lit(False), "")) for name in SCHEMA}
    return {
        name: (wrong if name in NULLABLE else pl.col(name).is_null() | wrong, allowed or "must not be null")
        for name, (wrong, allowed) in named.items()
    }
