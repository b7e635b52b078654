"""Options of `jaxbiped stereo`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar

import tyro
from pydantic import Field

from jaxbiped.commands.options.charting import ChartArgs
from jaxbiped.mapping.config import ONE_LOOK, ChartConfig
from jaxbiped.stereo.config import MatchParams


class StereoArgs(ChartArgs):
    """Map what a stereo pair shows: points, 3D grid and class grid, with pictures."""

    BASIC: ClassVar[tuple[str, ...]] = (
        *("left", "right", "camera", "max_range", "num_disparities", "pitch", "area", "robot_file", "out"),
    )

    left: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="LEFT")]
    """The picture of the left camera: PNG, JPEG, TIFF, PGM, ...; grey or colour, 8 or 16 bits."""
    right: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="RIGHT")]
    """The picture of the right camera."""
    camera: Annotated[Path, tyro.conf.arg(metavar="FILE")]
    """Calibration: .toml, .yaml of OpenCV or of ROS (left.yaml beside right.yaml), .xml, or Middlebury's calib.txt."""
    max_range: Annotated[float | None, Field(gt=0, le=1000), tyro.conf.arg(metavar="FLOAT")] = None
    """[m] Drop points farther away. Default: where depth is as uncertain as at 2 m with the paper's camera."""
    num_disparities: Annotated[int | None, Field(ge=16, le=2048, multiple_of=16), tyro.conf.arg(metavar="INT")] = None
    """[px] Search range. Default: that of the camera file, else of --match."""
    match: MatchParams = MatchParams()
    """Parameters of the matcher."""
    map: ChartConfig = ONE_LOOK
    """Thresholds of the map."""
