"""Disparity of a rectified pair: OpenCV's semi-global matcher, and which of its pixels to trust."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32, UInt8

from jaxbiped.core.signatures import checked
from jaxbiped.errors import InputError
from jaxbiped.stereo.semi_global import STEPS, MatchParams, agreement, search
from jaxbiped.stereo.slanted import search_slanted

SHARPER = 5.0  # [px] up to which the second search, which is more accurate, corrects the first


@dataclass(frozen=True)
class Disparity:
    """The position of each pixel of the left image in the right one: column x - value."""

    value: Float32[np.ndarray, "H W"]  # [px]; 0 where not valid
    valid: Bool[np.ndarray, "H W"]  # measured


@checked()
def match(left: np.ndarray, right: np.ndarray, params: MatchParams | None = None) -> Disparity:
    """Disparity of a rectified pair of 8-bit images, grey [H, W] or RGB [H, W, 3].

    Host code; the result is the same for any number of threads.

    A pixel is valid if the matcher is certain of it, its match lies inside the right image, and the gradients of both
    images agree there (`MatchParams.agreement`). Slanted surfaces are measured by a second search (`slanted`). Small
    valid patches are dropped. Images are extended by the search range, so that no margin of the image is lost. (Paper,
    2.1, which does not describe the matching.)

    Raises:
      InputError: images of different size, of another type, or too wide for 32-bit numbers.
    """
    params = params or MatchParams()
    left, right = grey(left, "left"), grey(right, "right")
    if left.shape != right.shape:
        message = f"must have the size of the left image, {size(left)}"
        raise InputError(message, field="right", value=size(right))
    found = search(left, right, params)
    highest = (params.min_disparity - 1) * STEPS
    value = found.astype(np.float32) / STEPS
    column = np.arange(left.shape[1], dtype=np.float32)[None] - value
    valid = (found > highest) & (column >= 0) & (column <= left.shape[1] - 1)
    if params.agreement > -1:
        valid &= agreement(left, right, column, params.agreement_window) >= params.agreement
    if params.slanted:
        beside, there = search_slanted(left, right, params)
        there &= ~valid | (np.abs(beside - value) < SHARPER)
        value, valid = np.where(there, beside, value), valid | there
    if params.speckle_size:
        found = np.where(valid, np.rint(value * STEPS), highest).astype(np.int16)
        cv2.filterSpeckles(found, highest, params.speckle_size, params.speckle_range * STEPS)
        valid = found > highest
    return Disparity(np.where(valid, value, np.float32(0)), valid)


def grey(image: np.ndarray, field: str = "image") -> UInt8[np.ndarray, "H W"]:
    """An 8-bit image, grey or RGB, as grey; raise `InputError` about anything else."""
    if not isinstance(image, np.ndarray):
        raise InputError("must be a NumPy array, 8 bits, [H, W] or [H, W, 3]", field=field, value=type(image).__name__)
    if image.dtype != np.uint8 or image.ndim not in (2, 3) or image.shape[2:] not in ((), (3,)) or image.size == 0:
        got = f"{image.dtype} {list(image.shape)}"
        raise InputError("must be an 8-bit image [H, W] or [H, W, 3]", field=field, value=got)
    return np.ascontiguousarray(image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))


def size(image: np.ndarray) -> str:
    """Width x height, for a message."""
    return f"{image.shape[1]} x {image.shape[0]}"
