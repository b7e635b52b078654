"""Elevation maps as files: `.npz`, grey PNG and TIFF, and Esri's ASCII grid (`.asc`).

Row 0 of an `Elevation` is that of least y. The top row of a picture, and the first of an ASCII grid, is that of
greatest y, as on a map with north up.

- `.npz`: `heights` [P, Q] in metres, row 0 of least y, NaN a hole; `pitch` in metres; and, if it is not at (0, 0),
  `origin_xy` [2] in metres, the place of `heights[0, 0]`. No other keys.
- PNG and TIFF of 8 or 16 bits: grey, or colour whose channels are equal. The options `cell` and `range` say how large
  a pixel is, and which heights the darkest and the brightest value there can be stand for: 0 and 255, or 0 and 65535.
  Pixels that are not opaque are holes, and so are those of the value `hole`.
- TIFF of floating-point numbers: these are heights in metres; `cell` is needed, and there is no `range`.
- `.asc`: `ncols`, `nrows`, `cellsize` (or equal `dx` and `dy`), `xllcorner` or `xllcenter`, `yllcorner` or
  `yllcenter`, `NODATA_value` (-9999 by default), in any case; then the heights. Other keys are ignored.

Heights below 0 are allowed, and so are holes; what is not finite is one.
"""

from __future__ import annotations

import io
import re
import warnings
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path

import cv2
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Float64, Shaped
from PIL import Image, UnidentifiedImageError

from jaxbiped.errors import InputError
from jaxbiped.files import read_text, reason, write_whole
from jaxbiped.geometry.height_field import HeightField
from jaxbiped.mapping.grid import MOST_CELLS
from jaxbiped.sensing.image_depth import (
    COLOURS,
    HEIGHT,
    PNG,
    RGB,
    TIFF,
    WHITE_IS_0,
    WIDTH,
    no_chatter,
    sample_bits,
    tiff_tags,
)

SUFFIXES = (".npz", ".png", ".tif", ".tiff", ".asc")
KEYS = ("heights", "pitch", "origin_xy")
GREATEST = 1e4  # [m] of a height; what is more is a mark for "no data" that the file does not declare
NO_DATA = -9999.0  # of an ASCII grid that names none
CORNERS = (("xllcorner", "xllcenter"), ("yllcorner", "yllcenter"))
ORIENTATION = 0x0112  # the EXIF tag


@dataclass(frozen=True)
class Elevation:
    """Heights on a lattice, on the host; at least 2 x 2, of which two differ."""

    heights: Float64[np.ndarray, "P Q"]  # [m] row i along y, column j along x; NaN where nothing was measured
    origin_xy: Float64[np.ndarray, "2"]  # [m] place of heights[0, 0]
    pitch: float  # [m] from a height to the next

    @property
    def size_xy(self) -> tuple[float, float]:
        """[m] from the first height to the last, along x and y."""
        rows, columns = self.heights.shape
        return (columns - 1) * self.pitch, (rows - 1) * self.pitch

    @property
    def holes(self) -> int:
        """How many heights are unknown."""
        return int(np.isnan(self.heights).sum())

    def field(self, floor: float = 0.0) -> HeightField:
        """The same for JAX, with heights above `floor` [m]."""
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
    """Read an elevation map by the suffix of its file; see the module for what each holds.

    Args:
      path: the file.
      cell: [m] a pixel of a picture.
      range: [m] heights of the darkest and of the brightest value of a picture of whole numbers.
      hole: the value of pixels of a picture that were not measured.
      scale: factor of all three axes, after everything else.
      prefix: of the names of these options in messages.

    Raises:
      InputError: no such file, another suffix, a damaged file, options that are needed or do not belong to this kind of
        file or are out of range, unequal channels, fewer than 2 x 2 heights, more than `MOST_CELLS`, no height, no two
        that differ, heights beyond `GREATEST`.
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
            raise InputError("is required for a picture: how many metres a pixel is", file=path, field=f"{prefix}cell")
        heights, origin_xy, pitch = read_picture(path, range, hole, prefix), np.zeros(2), cell
    heights = np.where(np.isfinite(heights), heights, np.nan)
    check_heights(heights, path)
    return Elevation(heights * scale, origin_xy * scale, pitch * scale)


def save_elevation(elevation: Elevation, path: str | Path) -> None:
    """Write the `.npz` that `load_elevation` reads, whole or not at all."""
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


def check_heights(heights: Float64[np.ndarray, "P Q"], path: Path) -> None:
    """Raise `InputError` unless the heights of a file make a surface."""
    known = heights[np.isfinite(heights)]
    if not known.size:
        message = "must hold heights; all are holes (NaN, no data or transparent)"
        raise InputError(message, file=path, value=f"{heights.size} holes")
    if np.abs(known).max() > GREATEST:
        message = f"must hold heights within {GREATEST:,.0f} m of 0; a mark for what was not measured must be declared"
        raise InputError(message, file=path, value=float(known[np.abs(known).argmax()]))
    if known.min() == known.max():
        raise InputError(f"must hold heights that differ; all are {known[0]:g} m", file=path)


def check_shape(rows: int, columns: int, path: Path) -> None:
    """Raise `InputError` about a file with too few or too many heights, before they are unpacked."""
    if min(rows, columns) < 2:
        raise InputError("must have at least 2 x 2 heights", file=path, value=f"{rows} x {columns}")
    if rows * columns > MOST_CELLS:
        raise InputError(f"must have at most {MOST_CELLS:,} heights", file=path, value=f"{rows} x {columns}")


def read_npz(path: Path) -> tuple[Float64[np.ndarray, "P Q"], Float64[np.ndarray, "2"], float]:
    """Heights, place of the first, and pitch."""
    damaged = InputError("is no .npz, or was cut short", file=path)
    try:
        with warnings.catch_warnings(), open(path, "rb") as file:
            warnings.simplefilter("ignore")  # of odd headers of NumPy
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
        raise InputError("holds pickled objects, which are refused", file=path) from None
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
    """The shape of an array in an `.npy`, of which no more than the header is read."""
    version = np.lib.format.read_magic(member)
    reader = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    return reader(member)[0]


def read_asc(path: Path) -> tuple[Float64[np.ndarray, "P Q"], Float64[np.ndarray, "2"], float]:
    """Heights, place of the first, and pitch."""
    words = read_text(path, otherwise="latin-1").split()
    header: dict[str, float] = {}
    while len(words) > 2 * len(header) and re.match(r"[A-Za-z_]", key := words[2 * len(header)]):
        if key.lower() in ("nan", "inf", "infinity"):
            break
        value = words[2 * len(header) + 1 : 2 * len(header) + 2]
        if key.lower() in header:
            raise InputError("must be given once", file=path, field=key.lower())
        header[key.lower()] = number(value[0] if value else "", path, key.lower())
    body = words[2 * len(header) :]
    if "cellsize" not in header and "dx" in header:
        if header["dx"] != header.get("dy"):
            message = "must be equal: cells are square"
            raise InputError(message, file=path, field="dx, dy", value=(header["dx"], header.get("dy")))
        header["cellsize"] = header["dx"]
    for key in ("ncols", "nrows", "cellsize"):
        if key not in header:
            raise InputError("is missing from the header of an ASCII grid", file=path, field=key)
        whole = key != "cellsize"
        if not 0 < header[key] < np.inf or (whole and header[key] % 1):
            raise InputError(f"must be a {'whole ' * whole}number above 0", file=path, field=key, value=header[key])
    rows, columns, pitch = int(header["nrows"]), int(header["ncols"]), header["cellsize"]
    check_shape(rows, columns, path)
    origin = []
    for corner, centre in CORNERS:
        value = header[corner] + pitch / 2 if corner in header else header.get(centre, pitch / 2)
        if not np.isfinite(value):
            raise InputError("must be finite", file=path, field=corner if corner in header else centre, value=value)
        origin.append(value)
    if len(body) != rows * columns:
        message = f"must hold nrows x ncols = {rows * columns} heights after its header"
        raise InputError(message, file=path, value=len(body))
    try:
        heights = np.array(body, np.float64)
    except ValueError:
        bad = next(word for word in body if not is_number(word))
        raise InputError("must hold numbers after its header", file=path, value=bad) from None
    heights = np.where(heights == header.get("nodata_value", NO_DATA), np.nan, heights)
    return heights.reshape(rows, columns)[::-1].copy(), np.array(origin), pitch


def is_number(word: str) -> bool:
    """Whether Python reads a word as a number."""
    try:
        float(word)
    except ValueError:
        return False
    return True


def number(word: str, path: Path, key: str) -> float:
    """The value of a header's key."""
    if not is_number(word):
        raise InputError("must be a number", file=path, field=key, value=word)
    return float(word)


def read_picture(
    path: Path, range: tuple[float, float] | None, hole: float | None, prefix: str
) -> Float64[np.ndarray, "P Q"]:
    """Heights [m] of a picture, lowest row first."""
    values, opaque, full = grey_values(path)
    if full is None:
        if range is not None:
            message = "goes with whole numbers; this picture holds floating-point ones, which are heights in metres"
            raise InputError(message, file=path, field=f"{prefix}range", value=range)
        heights = values.astype(np.float64)
    else:
        if range is None:
            message = f"is required: heights LOW and HIGH [m] of the values 0 and {full}"
            raise InputError(message, file=path, field=f"{prefix}range")
        heights = range[0] + values / full * (range[1] - range[0])
    known = opaque if hole is None else opaque & (values != hole)
    return np.where(known, heights, np.nan)[::-1].copy()


def grey_values(path: Path) -> tuple[Float[np.ndarray, "P Q"], Shaped[np.ndarray, "P Q"], int | None]:
    """Values of a picture, top row first; where it is opaque; and the greatest value there can be, None of reals."""
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise InputError("no such file", file=path) from None
    except OSError as error:
        raise InputError(f"cannot be read: {reason(error)}", file=path) from None
    if not data.startswith((PNG, *TIFF)):
        raise InputError("must be a PNG or TIFF picture", file=path)
    try:
        with no_chatter():
            samples = read_deep(data, path) if sample_bits(data) > 8 else read_shallow(data, path)
    except InputError:
        raise
    except UnidentifiedImageError:
        raise InputError("is damaged, or a kind of picture that is not supported", file=path) from None
    except Exception:  # Pillow and OpenCV raise whatever a damaged picture makes them trip over
        raise InputError("is damaged or cut short", file=path) from None
    full = int(np.iinfo(samples.dtype).max) if samples.dtype.kind == "u" else None
    if samples.dtype.kind not in "uf" or (full or 0) > 65535:
        raise InputError("must be of 8 or 16 bits, or of floating-point numbers", file=path, value=str(samples.dtype))
    samples = samples if samples.ndim == 3 else samples[..., None]
    opaque = np.ones(samples.shape[:2], bool)
    if samples.shape[2] in (2, 4):
        opaque = samples[..., -1] == (1.0 if full is None else full)
        samples = samples[..., :-1]
    first = samples[..., :1]
    unequal = ((samples != first) & ((samples == samples) | (first == first))).any(2) & opaque  # NaN equals NaN
    if unequal.any():
        i, j = np.argwhere(unequal)[0]
        message = "must be grey: its channels differ, and a colour is no height"
        raise InputError(message, file=path, field=f"pixel ({j}, {i})", value=tuple(samples[i, j].tolist()))
    return samples[..., 0].astype(np.float64), opaque, full


def read_shallow(data: bytes, path: Path) -> Shaped[np.ndarray, "P Q 4"]:
    """RGBA of a picture of at most 8 bits."""
    with Image.open(io.BytesIO(data), formats=("PNG", "TIFF")) as picture:
        check_shape(picture.height, picture.width, path)
        picture.load()
        turned = picture.getexif().get(ORIENTATION, 1)
        if turned != 1:
            raise InputError("must be upright as it is stored, not turned by its EXIF tag", file=path, value=turned)
        return np.asarray(picture.convert("RGBA"))


def read_deep(data: bytes, path: Path) -> Shaped[np.ndarray, "P Q *C"]:
    """Samples of a picture of more than 8 bits, whose bits OpenCV keeps: grey, or colour and perhaps alpha."""
    colours = None
    if data.startswith(PNG):
        with Image.open(io.BytesIO(data), formats=("PNG",)) as picture:  # which knows a file that is cut short
            check_shape(picture.height, picture.width, path)
            picture.load()
    else:
        tags = tiff_tags(data)
        check_shape(int(tags[HEIGHT]), int(tags[WIDTH]), path)
        colours = tags.get(COLOURS)
        if colours not in (0, 1, RGB):
            raise InputError("must be grey, or colour whose channels are equal (RGB)", file=path)
    before = cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        samples = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    finally:
        cv2.utils.logging.setLogLevel(before)
    if samples is None or samples.dtype.itemsize * 8 < sample_bits(data):
        raise InputError("is damaged, or a kind of picture that is not supported", file=path)
    if colours == WHITE_IS_0:
        if samples.dtype.kind != "u":
            raise InputError("must not be a picture in which 0 is white and samples are reals", file=path)
        samples = np.iinfo(samples.dtype).max - samples
    return samples
