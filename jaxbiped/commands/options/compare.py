"""Options of `jaxbiped compare`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar, Literal

import pydantic

from jaxbiped.commands.options.base import CameraFileOptions, RobotFileOptions
from jaxbiped.commands.options.engine import EngineArgs
from jaxbiped.commands.options.strategies import strategy_notes
from jaxbiped.core.names import MEASURES
from jaxbiped.study.config import StudyConfig


class CompareArgs(EngineArgs, RobotFileOptions, CameraFileOptions, StudyConfig):
    """Compare strategies on the same random arenas, with paired statistics.

    A study in TOML may come first; options override it. Scenes in its place, or a folder of them, are the arenas:
    jaxbiped compare configs/scenes/*.toml. A results folder, or two, are compared without running again: see
    `jaxbiped compare FOLDER --help`.
    """

    BASIC: ClassVar[tuple[str, ...]] = (
        *("seed", "arenas", "families", "strategies", "mission.sensor", "mission.preset", "mission.executor"),
        *("robot_file", "camera_file", "resume", "out"),
    )
    NOTES: ClassVar[str] = strategy_notes()

    out: Path | None = None
    """Folder to write, which must not exist. Default: results/compare-<hash of the study>."""
    resume: bool = False
    """Go on with the study in the folder where it was stopped, or begin it."""
    until_width: Annotated[float, pydantic.Field(gt=0.0)] | None = None
    """[fraction, m or s] Stop after the shard that brings the interval of a difference to this width; it holds at every
    look. `--arenas` is then the most, `--shard` how many between looks."""
    measure: Literal[MEASURES] = "success"
    """Whose difference `--until-width` is about."""
    first: str | None = None
    """Of that difference: first minus second; by default the pair that the report is about."""
    second: str | None = None
