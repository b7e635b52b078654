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
    """The file is an elevation map. Levels are steps of the robot, and holes are unmeasured."""
    cell: Annotated[Annotated[float, Field(gt=0, le=1e6)] | None, tyro.conf.arg(metavar="FLOAT")] = None
    """[m] Size of a pixel, if the elevation map is a picture."""
    range: Pair = None
    """[m] Heights of the darkest and the brightest possible value in such a picture."""
    hole: Annotated[float | None, tyro.conf.arg(metavar="FLOAT")] = None
    """Value of unmeasured pixels in such a picture."""
    scale: Annotated[float, Field(gt=0, le=1e4)] = 1.0
    """[m] One unit of the cloud; 0.001 for millimetres. For an elevation map, the factor of all three axes, to scale
    a building to the robot's size."""
    up: Vector = None
    """The direction opposite to gravity in the cloud's frame. Default: the normal of the floor that is found within 30
    degrees of z, else of y or -y. Required if a plane larger than that floor is tilted by more."""
    tilt: Annotated[float, Field(ge=0, le=60)] = 10.0
    """[deg] Possible error of --up; 0 to take it as given."""
    floor: Annotated[Metres | None, tyro.conf.arg(metavar="FLOAT")] = None
    """[m] Height of the floor along --up, both taken as given. With --heightmap, height of level 0, after --scale.
    Default: found."""
