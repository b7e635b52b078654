"""Options of `jaxbiped run`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar

import pydantic
import tyro

from jaxbiped.commands.options.base import CameraFileOptions, RobotFileOptions
from jaxbiped.commands.options.strategies import strategy_notes
from jaxbiped.mission.config import MissionConfig
from jaxbiped.study.config import StrategyName


class RunArgs(RobotFileOptions, CameraFileOptions):
    """Run one mission in a scene: print the primitives that the robot plays, and write pictures of its map."""

    BASIC: ClassVar[tuple[str, ...]] = (
        *("scene", "strategy", "seed", "mission.sensor", "mission.preset", "mission.executor"),
        *("mission.planner", "robot_file", "camera_file", "out"),
    )
    NOTES: ClassVar[str] = strategy_notes()

    scene: tyro.conf.Positional[Path]
    """The scene, a TOML file; the paper's six are in configs/scenes."""
    strategy: StrategyName = "full"
    """What the robot plans with, and what it may cross."""
    seed: Annotated[int, pydantic.Field(ge=0, lt=2**32)] = 0
    """Seed of all noise."""
    out: Path | None = None
    """Folder to write, which must not exist. Default: results/run-<scene>-<strategy>-<hash of these options>."""
    mission: Annotated[MissionConfig, tyro.conf.arg(name="")] = MissionConfig()
