"""A classed 2D grid map, and its file: what `classify` and `stereo` write and `plan` reads."""

from __future__ import annotations

import enum
import math
import warnings
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float64, Int, Int8

from jaxbiped.errors import InputError
from jaxbiped.files import reason, write_whole

KEYS = ("classes", "levels", "origin_xy", "pitch")
MOST_CELLS = 4_000_000  # of a grid: more than a map of this kind ever has, and what memory holds


class Cell(enum.IntEnum):
    """Class of a cell of the 2D grid map (paper, 2.2)."""

    UNMEASURED = 0
    FLOOR = 1
    BUMP = 2
    GATE = 3
    OBSTACLE = 4


@dataclass(frozen=True)
class ClassGrid:
    """One map on the host, in NumPy. Row i is along y, column j along x; the grid may be turned in its frame.

    Raises:
      InputError: a field with a wrong shape, type or value.
    """

    classes: Int8[np.ndarray, "H W"]  # `Cell` of each cell
    levels: Int8[np.ndarray, "H W"]  # level of the ground, in steps
    origin_xy: Float64[np.ndarray, "2"]  # [m] outer corner of cell (0, 0)
    pitch: float  # [m] side of a cell
    yaw: float = 0.0  # [rad] of the grid's axes, about `origin_xy`; the file holds none

    def __post_init__(self):
        check({key: getattr(self, key) for key in KEYS})
        if not math.isfinite(self.yaw):
            raise InputError("must be finite", field="yaw", value=self.yaw)

    @property
    def shape(self) -> tuple[int, int]:
        """(H, W)."""
        return self.classes.shape

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """(least x, greatest x, least y, greatest y) [m] of the outer border, before the grid is turned."""
        (x, y), (rows, columns) = self.origin_xy, self.shape
        return float(x), float(x + columns * self.pitch), float(y), float(y + rows * self.pitch)

    @property
    def axes(self) -> Float64[np.ndarray, "2 2"]:
        """Unit vectors along x and y of the grid, as columns."""
        cos, sin = (math.cos(self.yaw), math.sin(self.yaw)) if self.yaw else (1.0, 0.0)
        return np.array([[cos, -sin], [sin, cos]])

    def cell_at(self, xy: tuple[float, float], field: str = "xy", file: Path | None = None) -> tuple[int, int]:
        """Row and column (i, j) of the cell that holds the point `xy` [m].

        A cell holds its lower borders and not its upper ones; so does the map.

        Raises:
          InputError: the point is outside the map, or not a number; `field` and `file` name it.
        """
        x0, x1, y0, y1 = self.extent
        x, y = self.origin_xy + self.axes.T @ (np.asarray(xy, float) - self.origin_xy) if self.yaw else xy
        if not (x0 <= x < x1 and y0 <= y < y1):
            turned = f", turned by {self.yaw:g} rad about ({x0:g}, {y0:g}) m" if self.yaw else ""
            allowed = f"must lie on the map, x in [{x0:g}, {x1:g}) m and y in [{y0:g}, {y1:g}) m{turned}"
            raise InputError(allowed, file=file, field=field, value=tuple(map(float, xy)))
        j, i = (int(steps) for steps in np.floor((np.array([x, y], float) - self.origin_xy) / self.pitch))
        return min(i, self.shape[0] - 1), min(j, self.shape[1] - 1)  # rounding may lift a point by one ulp

    def centres_xy(self, cells_ij: Int[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2"]:
        """Centres [m] of cells (i, j), as (x, y)."""
        along = (np.asarray(cells_ij)[:, ::-1] + 0.5) * self.pitch
        return self.origin_xy + along @ self.axes.T


def check(fields: dict[str, object], file: str | Path | None = None) -> None:
    """Raise `InputError` unless `fields` are those of a `ClassGrid`; `file` names where they come from."""
    for key in KEYS:
        if key not in fields:
            raise InputError(f"is missing; a class grid holds {', '.join(KEYS)}", file=file, field=key)
    for key in fields:
        if key not in KEYS:
            raise InputError(f"unknown key; a class grid holds {', '.join(KEYS)}", file=file, field=key)
    for key in ("classes", "levels"):
        value = fields[key]
        if not isinstance(value, np.ndarray) or value.ndim != 2 or value.size == 0:
            raise InputError(
                "must be an array [H, W] with at least one cell", file=file, field=key, value=outline(value)
            )
        if value.dtype != np.int8:
            raise InputError("must be of type int8", file=file, field=key, value=outline(value))
    classes, levels, origin = (fields[key] for key in KEYS[:3])
    if levels.shape != classes.shape:
        raise InputError(
            f"must have the shape of classes, {classes.shape}", file=file, field="levels", value=levels.shape
        )
    wrong = np.argwhere((classes < min(Cell)) | (classes > max(Cell)))
    if len(wrong):
        i, j = (int(index) for index in wrong[0])
        allowed = ", ".join(f"{cell.value} {cell.name.lower()}" for cell in Cell)
        raise InputError(f"must be one of {allowed}", file=file, field=f"classes[{i}, {j}]", value=int(classes[i, j]))
    if np.shape(origin) != (2,) or np.asarray(origin).dtype.kind not in "iuf" or not np.isfinite(origin).all():
        raise InputError("must be two finite numbers x, y [m]", file=file, field="origin_xy", value=outline(origin))
    pitch = fields["pitch"]
    if np.shape(pitch) != () or np.asarray(pitch).dtype.kind not in "iuf":
        raise InputError("must be one number [m]", file=file, field="pitch", value=outline(pitch))
    if not (np.isfinite(pitch) and pitch > 0):
        raise InputError("must be finite and above 0 m", file=file, field="pitch", value=float(pitch))


def outline(value: object) -> object:
    """An array as its type and shape, for a message; small ones and other things as they are."""
    if isinstance(value, np.ndarray):
        return value.tolist() if value.size <= 3 else f"{value.dtype} {list(value.shape)}"
    return value


def save(grid: ClassGrid, path: str | Path) -> None:
    """Write `grid` to the `.npz` file `path`, whole or not at all; raise `InputError` when that fails.

    A grid that is turned is refused: the file has no place for its yaw.
    """
    if grid.yaw:
        raise InputError("must be 0 in a class grid file", file=path, field="yaw", value=grid.yaw)
    arrays = {key: np.asarray(getattr(grid, key)) for key in KEYS}
    write_whole(path, lambda file: np.savez_compressed(file, **arrays))


def read_arrays(path: str | Path) -> dict[str, np.ndarray | None]:
    """The arrays of an `.npz` under `KEYS`, and the first other key as None; raises what NumPy raises."""
    with open(path, "rb") as file:
        archive = np.load(file, allow_pickle=False)
        if isinstance(archive, np.ndarray):
            raise InputError("must be an .npz class grid, not a single array", file=path)
        names = [name for name in archive.files if name in KEYS] + [n for n in archive.files if n not in KEYS][:1]
        return {name: archive[name] if name in KEYS else None for name in names}


def load(path: str | Path) -> ClassGrid:
    """Read a class grid.

    Raises:
      InputError: no such file, no `.npz`, cut short or damaged, pickled objects (never unpickled), keys that are
        missing or unknown, wrong shapes, types or values.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of odd headers; what they hold is checked below
            fields = read_arrays(path)
    except FileNotFoundError:
        raise InputError("no such file", file=path) from None
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"cannot be read: {reason(error)}", file=path) from None
    except ValueError as error:
        what = "holds pickled objects, which are refused" if "pickle" in str(error) else "is no .npz class grid"
        raise InputError(what, file=path) from None
    except (zipfile.BadZipFile, zlib.error, EOFError, KeyError, MemoryError, NotImplementedError, SyntaxError):
        raise InputError("is no .npz class grid, or was cut short", file=path) from None
    check(fields, file=path)
    return ClassGrid(fields["classes"], fields["levels"], fields["origin_xy"].astype(float), float(fields["pitch"]))
