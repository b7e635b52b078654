"""Pictures from files: any depth of grey or colour, as 8 bits."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from jaxbiped.errors import InputError
from jaxbiped.files import reason
from jaxbiped.sensing.stereo.matching import size

MOST_PIXELS = 64_000_000
DEEP = ("I;16", "I;16B", "I;16L", "I;16N", "I", "F")  # modes of more than 8 bits


def load_pair(left: str | Path, right: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """The two pictures of a pair, UInt8 [H, W] or [H, W, 3].

    Pictures of more than 8 bits are scaled by one factor for both, so that the brightest 0.1 % of their pixels are
    white: a matcher compares them.

    Raises:
      InputError: no such file, no picture, a damaged one, one of over 64 million pixels, or without two grey levels;
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
    """One picture: 8 bits grey or RGB, or more bits grey."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # the limit below is ours
            with Image.open(path) as picture:
                if picture.width * picture.height > MOST_PIXELS:
                    message = f"must have at most {MOST_PIXELS:,} pixels"
                    raise InputError(message, file=path, field=field, value=f"{picture.width} x {picture.height}")
                picture.load()
                if picture.mode in DEEP:
                    values = np.nan_to_num(np.asarray(picture, np.float32), posinf=0, neginf=0)
                    return np.maximum(values, 0)
                return np.asarray(picture.convert("L" if picture.mode in ("L", "LA", "1") else "RGB"))
    except FileNotFoundError:
        raise InputError("no such file", file=path, field=field) from None
    except InputError:
        raise
    except (OSError, SyntaxError, ValueError, EOFError, Image.DecompressionBombError) as error:
        what = reason(error) if isinstance(error, OSError) and error.errno else str(error) or type(error).__name__
        raise InputError(f"is no picture, or is damaged: {what}", file=path, field=field) from None


def as_rgb(image: UInt8[np.ndarray, "H W *C"]) -> UInt8[np.ndarray, "N 3"]:
    """Colours of all pixels, row after row."""
    return np.repeat(image.reshape(-1, 1), 3, axis=1) if image.ndim == 2 else image.reshape(-1, 3)
