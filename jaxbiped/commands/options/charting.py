"""Options that `jaxbiped stereo` and `jaxbiped classify` share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro
from pydantic import Field

from jaxbiped.commands.options.base import RobotFileOptions
from jaxbiped.mapping.config import SCAN, ChartConfig
from jaxbiped.motion.config import RobotConfig

Metres = Annotated[float, Field(ge=-1e9, le=1e9)]
Area = Annotated[tuple[float, float, float, float] | None, tyro.conf.arg(metavar="X0 X1 Y0 Y1")]
Folder = Annotated[Path | None, tyro.conf.arg(metavar="PATH")]


class ChartArgs(RobotFileOptions):
    """Options of both commands."""

    pitch: float = Field(0.05, ge=0.005, le=10.0)
    """[m] Side of a cell."""
    area: Area = None
    """[m] Area to map. Default: the area of the points."""
    robot: RobotConfig = RobotConfig()
    """The robot that the map is made for."""
    map: ChartConfig = SCAN
    """Thresholds of the map."""
    seed: Annotated[int, Field(ge=0, lt=2**32)] = 0
    """Seed of the search for the floor."""
    out: Folder = None
    """Folder to write, which must not exist. Default: results/<command>-<hash of these options>."""
