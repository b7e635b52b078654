"""A map in any of the three formats, and how positions on it are written."""

from __future__ import annotations

import codecs
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jaxbiped.core import class_grid
from jaxbiped.core.class_grid import ClassGrid
from jaxbiped.errors import InputError
from jaxbiped.files import reason
from jaxbiped.formats import moving_ai, ros_map
from jaxbiped.mapping.grid import Cell
from jaxbiped.mapping.inflation import inflate
from jaxbiped.report.axis import CENTIMETRES, METRES, Axis

SUFFIXES = {
    ".map": "Moving AI map",
    ".npz": "class grid",
    ".yaml": "ROS map",
    ".yml": "ROS map",
    ".png": "ROS map",
    ".pgm": "ROS map",
}
BEGINNINGS = {b"type ": "Moving AI map", b"PK": "class grid", b"\x89PNG": "ROS map", b"P5": "ROS map", b"P2": "ROS map"}
LARGEST_IN_CENTIMETRES = 5.0  # [m] a map beyond this is drawn in metres


@dataclass(frozen=True)
class MapSource:
    """A map and where it comes from."""

    file: Path
    kind: str  # one of the values of SUFFIXES
    grid: ClassGrid  # obstacles grown
    radius: float  # [m] by which obstacles are grown

    @property
    def in_cells(self) -> bool:
        """Whether positions are column and row from the upper left, rather than metres."""
        return self.kind == "Moving AI map"

    @property
    def axis(self) -> Axis:
        """The axis on which the map is drawn."""
        if self.in_cells:
            return Axis("cells", 1 / self.grid.pitch, y_down=True)
        return CENTIMETRES if max(self.grid.shape) * self.grid.pitch <= LARGEST_IN_CENTIMETRES else METRES

    def free_cell(self, position: tuple[float, float], field: str) -> tuple[int, int]:
        """Row and column of a given position; raise `InputError` outside the map and in an obstacle."""
        if self.in_cells:
            rows, columns = self.grid.shape
            x, y = position
            if not (x == int(x) and y == int(y) and 0 <= x < columns and 0 <= y < rows):
                allowed = f"must be a whole column from 0 to {columns - 1} and row from 0 to {rows - 1}"
                raise InputError(allowed, file=self.file, field=field, value=position)
            cell = int(y), int(x)
        else:
            cell = self.grid.cell_at(position, field, self.file)
        if self.grid.classes[cell] == Cell.OBSTACLE:
            near = f" or closer to one than the radius of {self.radius:g} m" if self.radius else ""
            raise InputError(f"must not be inside an obstacle{near}", file=self.file, field=field, value=position)
        return cell

    def say(self, cell: tuple[int, int]) -> str:
        """A cell as a user would write it."""
        i, j = cell
        if self.in_cells:
            return f"({j}, {i})"
        ((x, y),) = self.grid.centres_xy(np.array([cell]))
        return f"({x:.3f}, {y:.3f}) m"


def open_map(file: Path, pitch: float, radius: float) -> MapSource:
    """Read a map by its suffix, or by its first bytes if the suffix is unknown.

    Args:
      file: the map.
      pitch: [m] side of a cell of a Moving AI map.
      radius: [m] by which obstacles grow.

    Raises:
      InputError: the file does not exist, is not a map, or is damaged.
    """
    kind = SUFFIXES.get(file.suffix.lower()) or kind_by_content(file)
    if kind == "Moving AI map":
        grid = moving_ai.load_map(file, pitch)
    elif kind == "class grid":
        grid = class_grid.load(file)
    else:
        grid = ros_map.load(file)
    return MapSource(file, kind, inflate(grid, radius) if radius else grid, radius)


def kind_by_content(file: Path) -> str:
    """The kind of map according to the first bytes of a file."""
    try:
        with open(file, "rb") as stream:
            head = stream.read(16).removeprefix(codecs.BOM_UTF8)
    except FileNotFoundError:
        raise InputError("no such file", file=file) from None
    except OSError as error:
        raise InputError(f"cannot be read: {reason(error)}", file=file) from None
    for beginning, kind in BEGINNINGS.items():
        if head.startswith(beginning):
            return kind
    message = "must be a Moving AI .map, a ROS map_server .yaml with its .png or .pgm, or a class grid .npz"
    raise InputError(message, file=file)
