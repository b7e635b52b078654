"""From verified trials to the primitive library, and its file."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import polars as pl

from jaxbiped.biped.config import RobotModelConfig
from jaxbiped.biped.gait import PrimitiveTable
from jaxbiped.biped.trial import RIMS, nominal_edge
from jaxbiped.executors.motion_library import Entry, Feet, LibraryConfig, Rims, Window

SET = "mild"  # the set of trials that the library's displacements come from


def library(
    rows: pl.DataFrame,
    tables: Mapping[str, PrimitiveTable],
    robot: RobotModelConfig,
    pace: str,
    seed: int,
    command: str,
) -> LibraryConfig:
    """The library of verified primitives. A mission needs all; a library of some can be written, but not read.

    Args:
      rows: trials as `commands.primitives` writes them.
    """
    entries = {name: entry(rows.filter(pl.col("primitive") == name), table, robot) for name, table in tables.items()}
    body, straight = robot.proportions, tables.get("straight")
    feet = Feet(length=body.foot_length, width=body.foot_width, offset=body.hip_offset)
    found = rims(rows, straight.request.forward, body.hip_offset) if straight else None
    return LibraryConfig.model_construct(
        command=command, pace=pace, seed=seed, feet=feet, rims=found, primitives=entries
    )


def rims(rows: pl.DataFrame, forward: float, offset: float) -> Rims:
    """Where unexpected edges may lie: half way between the nearest tolerated edge and the next."""
    found = {}
    for rim in RIMS:
        tried = rows.filter(pl.col("set") == f"rim {rim}").sort("edge")
        edges, fell = tried["edge"].to_numpy(), tried["fell"].to_numpy()
        last = int(np.flatnonzero(fell)[-1])
        middle = offset if rim.endswith("aside") else forward
        found[rim.replace(" ", "_")] = rounded([(edges[last] + edges[last + 1]) / 2 - middle])[0]
    return Rims(**found)


def entry(rows: pl.DataFrame, table: PrimitiveTable, robot: RobotModelConfig) -> Entry:
    """The library entry of one primitive."""
    request, mild = table.request, rows.filter(pl.col("set") == SET)
    mean, covariance = displacement(mild)
    asked = (request.forward, request.left, request.turn)
    tried = rows.filter(pl.col("set") == "window")
    standing = mild.filter(~pl.col("fell"))
    return Entry(
        request=rounded(asked),
        rise=request.rise,
        duration=table.duration,
        trials=len(mild),
        falls=int(mild["fell"].sum()),
        slips=int(mild["slipped"].sum()),
        touches=int(mild["touched"].sum()),
        displacement=rounded(mean + asked),
        covariance=tuple(rounded(row) for row in covariance),
        sway=rounded([standing["sway"].max() or 0.0])[0],
        window=window(tried, nominal_edge(request, robot)) if request.rise else None,
    )


def displacement(rows: pl.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    """Mean [3] and covariance [3, 3] of the error (x, y, yaw) [m, m, rad] over the trials that did not fall."""
    errors = rows.filter(~pl.col("fell")).select("error_x", "error_y", "error_yaw").to_numpy()
    if len(errors) < 2:
        return (errors.mean(axis=0) if len(errors) else np.zeros(3)), np.zeros((3, 3))
    return errors.mean(axis=0), np.cov(errors, rowvar=False)


def window(rows: pl.DataFrame, ahead: float) -> Window:
    """How a step ends, by the distance and the yaw of its edge."""
    shares = rows.group_by("edge", "yaw").agg(stands=1.0 - pl.col("fell").mean()).sort("edge", "yaw")
    edges, yaws = shares["edge"].unique().sort(), shares["yaw"].unique().sort()
    stands = shares["stands"].to_numpy().reshape(len(edges), len(yaws))
    return Window(
        ahead=rounded([ahead])[0], edge=rounded(edges), yaw=rounded(yaws), stands=tuple(rounded(row) for row in stands)
    )


def rounded(values) -> tuple[float, ...]:
    """Six significant digits: more than the trials determine."""
    return tuple(float(f"{value:.6g}") for value in values)


def library_text(made: LibraryConfig) -> str:
    """The library as TOML, with a header that says how it was made."""
    lines = [
        "# What simulation measured for each primitive; `--executor sampled` draws from it. Written by the command",
        "# below; do not edit. Lengths in metres, angles in radians, durations in seconds.",
        f"command = {quoted(made.command)}",
        f"pace = {quoted(made.pace)}",
        f"seed = {made.seed}",
    ]
    for name, one in (("feet", made.feet), ("rims", made.rims)):
        if one is not None:
            lines += ["", f"[{name}]", *(f"{key} = {written(value)}" for key, value in one.model_dump().items())]
    for name, one in made.primitives.items():
        values = one.model_dump(exclude={"window", "covariance"})
        lines += ["", f"[primitives.{name}]", *(f"{key} = {written(value)}" for key, value in values.items())]
        lines += block("covariance", one.covariance)
        if one.window is not None:
            lines += ["", f"[primitives.{name}.window]", f"ahead = {written(one.window.ahead)}"]
            lines += [
                f"edge = {written(one.window.edge)}",
                f"yaw = {written(one.window.yaw)}",
                *block("stands", one.window.stands),
            ]
    return "\n".join(lines) + "\n"


def block(key: str, rows) -> list[str]:
    """A table of numbers, one line per row."""
    return [f"{key} = [", *(f"    {written(row)}," for row in rows), "]"]


def written(value) -> str:
    """A number or a list of numbers in TOML."""
    if isinstance(value, tuple | list):
        return f"[{', '.join(written(each) for each in value)}]"
    return repr(value + 0.0) if isinstance(value, float) and math.isfinite(value) else str(value)


def quoted(text: str) -> str:
    """A string in TOML."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
