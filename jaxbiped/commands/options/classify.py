"""Options of `jaxbiped classify`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro
from pydantic import Field

from jaxbiped.commands.options.charting import ChartArgs, Metres

Vector = Annotated[tuple[float, float, float] | None, tyro.conf.arg(metavar="X Y Z")]


class ClassifyArgs(ChartArgs):
    """Map a point cloud: 3D grid and class grid, with pictures."""

    cloud: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="CLOUD")]
    """The cloud, .npz (points [N, 3], or x, y, z), .npy, .ply or .pcd."""
    scale: Annotated[float, Field(gt=0, le=1e4)] = 1.0
    """[m] One unit of the cloud; 0.001 for millimetres."""
    up: Vector = None
    """The direction against gravity in the cloud's frame. Default: found, z or else y or -y within 30 degrees. Must be
    given where a larger plane than that floor is tilted by more."""
    tilt: Annotated[float, Field(ge=0, le=60)] = 10.0
    """[deg] by which --up may be off; 0 to take it as it is."""
    floor: Annotated[Metres | None, tyro.conf.arg(metavar="FLOAT")] = None
    """[m] Height of the floor along --up, which is then taken as it is. Default: found."""
