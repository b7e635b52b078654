"""Pictures whose grey values are heights; see `elevation`."""

from __future__ import annotations

import io
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, Float64, Shaped
from PIL import Image, UnidentifiedImageError

from jaxbiped.core.image_depth import (
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
from jaxbiped.errors import InputError
from jaxbiped.files import reason
from jaxbiped.formats.heights import check_shape

ORIENTATION = 0x0112  # the EXIF tag


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
    """Values of a picture, top row first; where it is opaque; and the greatest possible value, None for reals."""
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
    except Exception:  # Pillow and OpenCV raise errors of many types for damaged pictures
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
        message = "must be grey: its channels differ, and a colour is not a height"
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
        with Image.open(io.BytesIO(data), formats=("PNG",)) as picture:  # it detects truncated files
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
