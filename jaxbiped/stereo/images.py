"""Pictures from files: any depth of grey or colour, rotated according to their EXIF tags, as 8 bits."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from jaxtyping import Float32, UInt8
from PIL import Image, ImageOps, UnidentifiedImageError

from jaxbiped.core.image_depth import (
    DEEP_COLOUR,
    HEIGHT,
    TIFF,
    WIDTH,
    UnsupportedError,
    deep_samples,
    no_chatter,
    sample_bits,
    tiff_tags,
)
from jaxbiped.errors import InputError
from jaxbiped.files import reason
from jaxbiped.stereo.matching import size

MOST_PIXELS = 64_000_000
DEEP = ("I;16", "I;16B", "I;16L", "I;16N", "I", "F")  # modes of more than 8 bits


def load_pair(left: str | Path, right: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """The two pictures of a pair, UInt8 [H, W] or [H, W, 3].

    Pictures of more than 8 bits are scaled by a common factor, so that the brightest 0.1 % of their pixels are white: a
    matcher compares them.

    Raises:
      InputError: no such file, not a picture, a damaged one, one of over 64 million pixels, or without two grey levels;
        pictures of different size.
    """
    pair = [read(path, field) for path, field in ((left, "left"), (right, "right"))]
    if pair[0].shape[:2] != pair[1].shape[:2]:
        message = f"must have the size of the left picture, {size(pair[0])}"
        raise InputError(message, file=right, field="right", value=size(pair[1]))
    if any(image.dtype != np.uint8 for image in pair):
        white = max(float(np.percentile(image, 99.9)) for image in pair)
        white = max(white, *(255.0 for image in pair if image.dtype == np.uint8), 1e-30)
        pair = [np.round(np.clip(image / white, 0, 1) * 255).astype(np.uint8) for image in pair]
    for image, path, field in ((pair[0], left, "left"), (pair[1], right, "right")):
        if image.min() == image.max():
            raise InputError(f"is blank: every pixel is {image.min()}", file=path, field=field)
    return tuple(pair)


def read(path: str | Path, field: str) -> np.ndarray:
    """One picture, upright: 8 bits grey or RGB, or float32 grey or RGB for more bits; alpha is dropped."""
    try:
        data = Path(path).read_bytes()
    except FileNotFoundError:
        raise InputError("no such file", file=path, field=field) from None
    except OSError as error:
        raise InputError(f"cannot be read: {reason(error)}", file=path, field=field) from None
    try:
        image = read_tiff(data, path, field) if data.startswith(TIFF) else None
        return read_any(data, path, field) if image is None else image
    except InputError:
        raise
    except UnsupportedError as error:
        raise InputError(f"is a kind of picture that is not supported: {error}", file=path, field=field) from None
    except UnidentifiedImageError:
        message = "is not a picture, or is damaged, or of a kind that is not supported"
        raise InputError(message, file=path, field=field) from None
    except Exception:  # Pillow raises errors of many types for damaged pictures
        raise InputError("is not a picture, or is damaged", file=path, field=field) from None


def read_tiff(data: bytes, path: str | Path, field: str) -> Float32[np.ndarray, "H W *C"] | None:
    """A TIFF picture of more than 8 bits; None if it has fewer, or if only Pillow can read it."""
    tags = tiff_tags(data)
    check_size(tags.get(WIDTH, 0), tags.get(HEIGHT, 0), path, field)
    samples = deep_samples(data) if sample_bits(data) > 8 else None
    return None if samples is None else as_light(samples)


def read_any(data: bytes, path: str | Path, field: str) -> np.ndarray:
    """Any picture that Pillow can read."""
    with no_chatter(), Image.open(io.BytesIO(data)) as picture:
        check_size(*picture.size, path, field)
        picture.load()
        picture = ImageOps.exif_transpose(picture)
        if picture.mode in DEEP:
            return as_light(np.asarray(picture))
        deep = sample_bits(data) > 8
        if deep or picture.format in DEEP_COLOUR:
            samples = deep_samples(data)
            if samples is not None and samples.dtype != np.uint8:
                return as_light(samples)
            if deep:
                raise UnsupportedError(f"{picture.mode} of {sample_bits(data)} bits per sample")
        return np.asarray(picture.convert("L" if picture.mode in ("L", "LA", "La", "1") else "RGB"))


def as_light(samples: np.ndarray) -> Float32[np.ndarray, "H W *C"]:
    """Samples clipped to 0 or more; values that are not finite become 0."""
    return np.maximum(np.nan_to_num(samples.astype(np.float32), posinf=0, neginf=0), 0)


def check_size(width: int, height: int, path: str | Path, field: str) -> None:
    """Raise `InputError` about a picture that is too large, before it is decoded."""
    if width * height > MOST_PIXELS:
        message = f"must have at most {MOST_PIXELS:,} pixels"
        raise InputError(message, file=path, field=field, value=f"{width} x {height}")


def as_rgb(image: UInt8[np.ndarray, "H W *C"]) -> UInt8[np.ndarray, "N 3"]:
    """Colours of all pixels, row by row."""
    return np.repeat(image.reshape(-1, 1), 3, axis=1) if image.ndim == 2 else image.reshape(-1, 3)
