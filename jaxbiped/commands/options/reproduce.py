"""Options of `jaxbiped reproduce`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import pydantic

from jaxbiped.commands.options.base import CameraFileOptions, RobotFileOptions


class ReproduceArgs(RobotFileOptions, CameraFileOptions):
    """Repeat the paper's experiments and write one page: its Tables 1 to 4 with our figures beside the paper's, the
    reasons where they differ, pictures like its figures, and the population behind its example.
    """

    scenes: Path = Path("configs/scenes")
    """Folder with the scenes of the experiments and of Table 1."""
    seed: Annotated[int, pydantic.Field(ge=0, lt=2**31)] = 0
    """Seed of all noise; repetitions use the next ones."""
    repeats: Annotated[int, pydantic.Field(ge=1, le=1000)] = 5
    """Missions of each experiment; the one with the median time is shown."""
    sensor: Literal["stereo", "raycast", "oracle"] = "stereo"
    """Sensor of the missions in the scenes."""
    executor: Literal["native", "mjx", "sampled", "kinematic"] = "native"
    """Executor of these missions."""
    preset: Annotated[str, pydantic.Field(exclude=True)] = "rendered"
    """How well the camera of these missions measures: ideal, rendered, real, or a sensor file (.toml). Like --robot and
    --camera, it applies only to the missions in the scenes; the paper's values are the default."""
    draws: Annotated[int, pydantic.Field(ge=0, le=100_000)] = 32
    """Trials of each primitive for Table 2; 0: none."""
    population: Annotated[int, pydantic.Field(ge=0, le=1_000_000)] = 1000
    """Random bumps, crossed and walked around, with executor `sampled` and sensor `raycast`; 0: none."""
    walked: Annotated[int, pydantic.Field(ge=0, le=1_000_000)] = 100
    """The same with executor `native`; 0: none."""
    out: Path | None = None
    """Folder to write, which must not exist. Default: results/reproduce-<hash of these options>."""
