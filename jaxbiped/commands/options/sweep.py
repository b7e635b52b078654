"""Options of `jaxbiped sweep`."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from jaxbiped.commands.options.base import CameraFileOptions, RobotFileOptions
from jaxbiped.commands.options.engine import EngineArgs
from jaxbiped.commands.options.strategies import strategy_notes
from jaxbiped.study.sweep import SweepConfig


class SweepArgs(EngineArgs, RobotFileOptions, CameraFileOptions, SweepConfig):
    """Sweep numbers of the config: missions on the same random arenas at each point, tables and figures.

    The sweep in TOML comes first, such as sweeps/studies/costs.toml; options on the command line override it.
    """

    BASIC: ClassVar[tuple[str, ...]] = (
        *("seed", "arenas", "families", "strategies", "mission.sensor", "mission.preset", "mission.executor"),
        *("robot_file", "camera_file", "resume", "out"),
    )
    NOTES: ClassVar[str] = strategy_notes()

    out: Path | None = None
    """Folder to write, which must not exist. Default: results/sweep-<hash of the sweep>."""
    resume: bool = False
    """Resume the sweep in the folder where it stopped, or start it."""
