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

    A study in TOML may come first; options override it. Scenes, or a folder of them, given instead are used as the
    arenas: jaxbiped compare configs/scenes/*.toml. One or two results folders are compared without running anything
    again: see `jaxbiped compare FOLDER --help`.
    """

    BASIC: ClassVar[tuple[str, ...]] = (
        *("seed", "arenas", "families", "strategies", "mission.sensor", "mission.preset", "mission.executor"),
        *("robot_file", "camera_file", "resume", "out"),
    )
    NOTES: ClassVar[str] = strategy_notes()

    out: Path | None = None
    """Folder to write, which must not exist. Default: results/compare-<hash of the study>."""
    resume: bool = False
    """Resume the study in the folder where it stopped, or start it."""
    until_width: Annotated[float, pydantic.Field(gt=0.0)] | None = None
    """[fraction, m or s] Stop after the shard that narrows the interval of a difference to this width; the interval
    holds at every look. `--arenas` is then the maximum, `--shard` the number between looks."""
    measure: Literal[MEASURES] = "success"
    """The measure whose difference `--until-width` refers to."""
    first: str | None = None
    """Of that difference: first minus second; by default the pair that the report is about."""
    second: str | None = None
