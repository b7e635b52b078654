"""What a type checker sees of the public names; `make lint` runs mypy over it, and it is never imported.

A name that a checker cannot see, or sees as `Any`, fails here, and so does an `ignore` that is not needed.
"""

from pathlib import Path
from typing import assert_type

import numpy as np
import polars as pl

import jaxbiped as jb


def study() -> None:
    made = jb.Study(arenas=jb.RandomArenas(families=["bump"], count=3), strategies=["full", "floor_only"])
    results = jb.evaluate(made)
    assert_type(results, jb.Results)
    assert_type(results.rows, pl.DataFrame)
    assert_type(results.save("folder"), Path)
    assert_type(results.strategies, tuple[str, ...])
    assert_type(jb.load("folder"), jb.Results)
    assert_type(jb.sweep(made, {"costs.c3": [1, 2.5]}), jb.Results)
    assert_type(str(results.compare("full", "floor_only")), str)
    jb.evaluate(made, out=5)  # type: ignore[arg-type]
    jb.Study(count=5)  # type: ignore[call-arg]


def mission() -> None:
    played = jb.play("scene.toml", "full")
    assert_type(played, jb.PlayedMission)
    assert_type(played.code, str)
    assert_type(played.distance, float)
    assert_type(jb.register(jb.StraightLine(), "straight"), str)


def planner(classes: np.ndarray, levels: np.ndarray, start: tuple[int, int], goal: tuple[int, int], costs: jb.Costs):
    return None


assert_type(jb.HostPlanner(planner), jb.HostPlanner)
assert_type(jb.MissionConfig(), jb.MissionConfig)
