"""Options of `jaxbiped classify`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar

import tyro
from pydantic import Field

from jaxbiped.commands.options.charting import ChartArgs, Metres

Pair = Annotated[tuple[Metres, Metres] | None, tyro.conf.arg(metavar="LOW HIGH")]
Vector = Annotated[tuple[float, float, float] | None, tyro.conf.arg(metavar="X Y Z")]


class ClassifyArgs(ChartArgs):
    """Map a point cloud or, with --heightmap, an elevation map: class grid and levels, with pictures."""

    BASIC: ClassVar[tuple[str, ...]] = (
        *("cloud", "heightmap", "cell", "range", "scale", "up", "floor", "pitch", "area", "robot_file", "out"),
    )

    cloud: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="FILE")]
    """The cloud, .npz (points [N, 3], or x, y, z), .npy, .ply or .pcd. The elevation map, .npz (heights [P, Q] and
    pitch, metres), .png or .tif (grey), or .asc (Esri)."""
    heightmap: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """The file is an elevation map. Its levels are steps of the robot, and holes in it are unmeasured."""
    cell: Annotated[Annotated[float, Field(gt=0, le=1e6)] | None, tyro.conf.arg(metavar="FLOAT")] = None
    """[m] A pixel of an elevation map that is a picture."""
    range: Pair = None
    """[m] Heights of the darkest and the brightest value there can be in such a picture."""
    hole: Annotated[float | None, tyro.conf.arg(metavar="FLOAT")] = None
    """Value of pixels of such a picture that were not measured."""
    scale: Annotated[float, Field(gt=0, le=1e4)] = 1.0
    """[m] One unit of the cloud; 0.001 for millimetres. Of an elevation map the factor of all three axes, which brings
    a building to the robot's size."""
    up: Vector = None
    """The direction against gravity in the cloud's frame. Default: found, z or else y or -y within 30 degrees. Must be
    given where a larger plane than that floor is tilted by more."""
    tilt: Annotated[float, Field(ge=0, le=60)] = 10.0
    """[deg] by which --up may be off; 0 to take it as it is."""
    floor: Annotated[Metres | None, tyro.conf.arg(metavar="FLOAT")] = None
    """[m] Height of the floor along --up, which is then taken as it is. With --heightmap, height of level 0, after
    --scale. Default: found."""
