"""Elevation maps as files: `.npz`, grey PNG and TIFF, and Esri's ASCII grid (`.asc`).

Row 0 of an `Elevation` has the smallest y. The top row of a picture, and the first of an ASCII grid, has the greatest
y, as on a map with north up.

- `.npz`: `heights` [P, Q] in metres, row 0 at the smallest y, NaN for holes; `pitch` in metres; and, unless it is
  (0, 0), `origin_xy` [2] in metres, the position of `heights[0, 0]`. No other keys.
- PNG and TIFF of 8 or 16 bits: grey, or colour with equal channels. The options `cell` and `range` give the size of a
  pixel, and the heights of the darkest and the brightest possible value: 0 and 255, or 0 and 65535. Pixels that are
  not opaque are holes, and so are those of the value `hole`.
- TIFF of floating-point numbers: these are heights in metres; `cell` is needed, and there is no `range`.
- `.asc`: `ncols`, `nrows`, `cellsize` (or equal `dx` and `dy`), `xllcorner` or `xllcenter`, `yllcorner` or
  `yllcenter`, `NODATA_value` (-9999 by default), in any case; then the heights. Other keys are ignored.

Heights below 0 are allowed, and so are holes; values that are not finite are holes.
"""

from __future__ import annotations

import io
import warnings
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float64

from jaxbiped.errors import InputError
from jaxbiped.files import reason, write_whole
from jaxbiped.formats.esri_grid import read_asc
from jaxbiped.formats.height_pictures import read_picture
from jaxbiped.formats.heights import GREATEST, check_heights, check_shape
from jaxbiped.geometry.height_field import HeightField

SUFFIXES = (".npz", ".png", ".tif", ".tiff", ".asc")
KEYS = ("heights", "pitch", "origin_xy")


@dataclass(frozen=True)
class Elevation:
    """Heights on a lattice, on the host; at least 2 x 2, not all equal."""

    heights: Float64[np.ndarray, "P Q"]  # [m] row i along y, column j along x; NaN where nothing was measured
    origin_xy: Float64[np.ndarray, "2"]  # [m] position of heights[0, 0]
    pitch: float  # [m] from one height to the next

    @property
    def size_xy(self) -> tuple[float, float]:
        """[m] from the first height to the last, along x and y."""
        rows, columns = self.heights.shape
        return (columns - 1) * self.pitch, (rows - 1) * self.pitch

    @property
    def holes(self) -> int:
        """Number of unknown heights."""
        return int(np.isnan(self.heights).sum())

    def field(self, floor: float = 0.0) -> HeightField:
        """The same for JAX, with heights relative to `floor` [m]."""
        return HeightField(
            heights=jnp.asarray(self.heights - floor, jnp.float32),
            origin_xy=jnp.asarray(self.origin_xy, jnp.float32),
            pitch=jnp.float32(self.pitch),
        )


def load_elevation(
    path: str | Path,
    *,
    cell: float | None = None,
    range: tuple[float, float] | None = None,
    hole: float | None = None,
    scale: float = 1.0,
    prefix: str = "",
) -> Elevation:
    """Read an elevation map by the suffix of its file; see the module for the formats.

    Args:
      path: the file.
      cell: [m] size of a pixel of a picture.
      range: [m] heights of the darkest and of the brightest value of a picture of whole numbers.
      hole: the value of unmeasured pixels of a picture.
      scale: factor of all three axes, after everything else.
      prefix: prefix of the names of these options in messages.

    Raises:
      InputError: no such file, an unknown suffix, a damaged file, options that are missing, do not apply to this kind
        of file or are out of range, unequal channels, fewer than 2 x 2 heights, more than `MOST_CELLS`, no height, all
        heights equal, heights beyond `GREATEST`.
    """
    path = Path(path)
    check_options(cell, range, scale, prefix)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        message = f"must be an elevation map, one of {', '.join(SUFFIXES)}"
        raise InputError(message, file=path, value=path.suffix)
    if suffix in (".npz", ".asc"):
        for name, value in (("cell", cell), ("range", range), ("hole", hole)):
            if value is not None:
                raise InputError(f"goes with pictures only, not with {suffix}", field=prefix + name, value=value)
        heights, origin_xy, pitch = (read_npz if suffix == ".npz" else read_asc)(path)
    else:
        if cell is None:
            raise InputError(
                "is required for a picture: the size of a pixel in metres", file=path, field=f"{prefix}cell"
            )
        heights, origin_xy, pitch = read_picture(path, range, hole, prefix), np.zeros(2), cell
    heights = np.where(np.isfinite(heights), heights, np.nan)
    check_heights(heights, path)
    return Elevation(heights * scale, origin_xy * scale, pitch * scale)


def save_elevation(elevation: Elevation, path: str | Path) -> None:
    """Write an `.npz` for `load_elevation`, whole or not at all."""
    arrays = {name: np.asarray(getattr(elevation, name)) for name in KEYS}
    write_whole(path, lambda file: np.savez_compressed(file, **arrays))


def check_options(cell: float | None, range: tuple[float, float] | None, scale: float, prefix: str) -> None:
    """Raise `InputError` about the first option that is out of range."""
    for name, value in (("cell", cell), ("scale", scale)):
        if value is not None and not 0 < value < np.inf:
            raise InputError("must be finite and above 0", field=prefix + name, value=value)
    if range is not None and not -GREATEST <= range[0] < range[1] <= GREATEST:
        message = f"must be LOW and HIGH [m], LOW below HIGH, within {GREATEST:g} m of 0"
        raise InputError(message, field=f"{prefix}range", value=range)


def read_npz(path: Path) -> tuple[Float64[np.ndarray, "P Q"], Float64[np.ndarray, "2"], float]:
    """Heights, position of the first, and pitch."""
    damaged = InputError("is not an .npz, or is cut short", file=path)
    try:
        with warnings.catch_warnings(), open(path, "rb") as file:
            warnings.simplefilter("ignore")  # about odd NumPy headers
            with zipfile.ZipFile(file) as archive:
                names = [name.removesuffix(".npy") for name in archive.namelist()]
                for name in KEYS[: 2 if "origin_xy" not in names else 3]:
                    if name not in names:
                        raise InputError(f"is missing; an elevation map holds {', '.join(KEYS)}", file=path, field=name)
                for name in names:
                    if name not in KEYS:
                        message = f"unknown key; an elevation map holds {', '.join(KEYS)}"
                        raise InputError(message, file=path, field=name)
                with archive.open("heights.npy") as member:
                    shape = header_shape(member)
                if len(shape) != 2:
                    raise InputError("must be an array [P, Q]", file=path, field="heights", value=list(shape))
                check_shape(*shape, path)
            file.seek(0)
            with np.load(file, allow_pickle=False) as arrays:
                values = {name: arrays[name] for name in names}
    except FileNotFoundError:
        raise InputError("no such file", file=path) from None
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"cannot be read: {reason(error)}", file=path) from None
    except ValueError as error:
        if "pickle" not in str(error) and "Object" not in str(error):
            raise damaged from None
        raise InputError("holds pickled objects, which are rejected", file=path) from None
    except (zipfile.BadZipFile, zlib.error, EOFError, KeyError, MemoryError, NotImplementedError, SyntaxError):
        raise damaged from None
    for name, value in values.items():
        if value.dtype.kind not in "iuf":
            raise InputError("must be real numbers", file=path, field=name, value=f"{value.dtype} {list(value.shape)}")
    pitch, origin_xy = values["pitch"], values.get("origin_xy", np.zeros(2))
    if pitch.shape != () or not 0 < pitch < np.inf:
        raise InputError("must be one number above 0 [m]", file=path, field="pitch", value=pitch)
    if origin_xy.shape != (2,) or not np.isfinite(origin_xy).all():
        raise InputError("must be two finite numbers x, y [m]", file=path, field="origin_xy", value=origin_xy)
    return values["heights"].astype(np.float64), origin_xy.astype(np.float64), float(pitch)


def header_shape(member: io.BufferedIOBase) -> tuple[int, ...]:
    """The shape of an array in an `.npy`, from its header alone."""
    version = np.lib.format.read_magic(member)
    reader = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    return reader(member)[0]
