"""A second search for surfaces beside the path, which one image shows much wider than the other.

A matcher compares windows of one size, and its path costs favour surfaces that face the camera. When the robot walks
along a wall 17 cm to its right, the left image shows each piece twice as wide as the right one; for a wall on its left,
it is the other way round. Hardly any of it is matched. With the wider image halved in width, both show it alike. (For
the effect of slant on width, and what a matcher can do about it: Ogale and Aloimonos, "Shape and the stereo
correspondence problem", International Journal of Computer Vision 65, 2005.)
"""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Bool, Float32, UInt8

from jaxbiped.sensing.noise import LEAST_WIDTH
from jaxbiped.stereo.semi_global import STEPS, MatchParams, agreement, search

REACH = 6  # [px] of the left image to each side over which the slope of disparity is measured
TRIED = (
    0.6  # of the first search's disparities, around those of a wall along the cameras' axis: 20 degrees to both sides
)
STRETCHES = 0.6, 4.0  # (`noise.stretch`) range kept; surfaces that face the camera more are the first search's
HALF = np.float32(0.5)
WHOLE = 5  # smallest size of kept regions in halved pixels, across and down: thinner strips are rims of other surfaces


def search_slanted(
    left: UInt8[np.ndarray, "H W"], right: UInt8[np.ndarray, "H W"], params: MatchParams
) -> tuple[Float32[np.ndarray, "H W"], Bool[np.ndarray, "H W"]]:
    """Disparities [px] of such slanted surfaces, and where there are any; 0 elsewhere.

    Both images are halved down as well: such surfaces are near, and large.

    Args:
      left, right: a rectified pair.
      params: as for the first search.
    """
    value, valid = np.zeros(left.shape, np.float32), np.zeros(left.shape, bool)
    high, wide = left.shape[0] // 2, left.shape[1] // 2
    if min(high, wide) < max(WHOLE, 2 * REACH):
        return value, valid
    for find in (rising, falling):
        columns, found, good = find(left[: 2 * high, : 2 * wide], right[: 2 * high, : 2 * wide], params)
        good &= (found > params.min_disparity) & (found < params.min_disparity + params.num_disparities - 1)
        for row in (0, 1):
            value[row : 2 * high : 2, columns] = np.where(good, found, value[row : 2 * high : 2, columns])
            valid[row : 2 * high : 2, columns] |= good
    return value, valid


Found = tuple[slice, Float32[np.ndarray, "h w"], Bool[np.ndarray, "h w"]]  # columns of the left image, what, and where


def rising(left: UInt8[np.ndarray, "H W"], right: UInt8[np.ndarray, "H W"], params: MatchParams) -> Found:
    """Disparities that rise to the right: the left image is the wider one."""
    wide, tried = left.shape[1] // 2, columns_tried(params)
    narrow, padded, other, shift = halves(left, right, tried, -params.min_disparity)
    raw = search(padded, other, params.model_copy(update={"min_disparity": 1 - tried, "speckle_size": 0}))[:, :wide]
    column = np.arange(wide, dtype=np.float32)
    there = column - raw.astype(np.float32) / STEPS  # in `other`
    valid = (raw > -tried * STEPS) & inside(there + shift, left.shape[1])
    valid &= agreement(narrow, other, there, params.agreement_window) >= params.agreement
    disparity = 2 * column + HALF - (there + shift)
    slope, even = slopes(disparity, valid, REACH // 2)
    valid = whole(even & within(slope / np.maximum(1 - slope, LEAST_WIDTH)), WHOLE)
    full = np.stack([disparity - HALF * slope, disparity + HALF * slope], axis=-1).reshape(len(valid), -1)
    return slice(0, 2 * wide), full, np.repeat(valid, 2, axis=1)


def falling(left: UInt8[np.ndarray, "H W"], right: UInt8[np.ndarray, "H W"], params: MatchParams) -> Found:
    """Disparities that fall to the right: the right image is the wider one."""
    wide, tried = left.shape[1] // 2, columns_tried(params)
    narrow, padded, other, shift = halves(right, left, tried, params.min_disparity // 2)
    raw = search(other, padded, params.model_copy(update={"min_disparity": 0, "speckle_size": 0}))
    column = np.arange(other.shape[1], dtype=np.float32)
    there = column - raw.astype(np.float32) / STEPS  # in `narrow`
    valid = (raw >= 0) & inside(there, wide) & inside(column + shift, left.shape[1])
    valid &= agreement(other, narrow, there, params.agreement_window) >= params.agreement
    disparity = column + shift - (2 * there + HALF)
    slope, even = slopes(disparity, valid, REACH)
    valid = whole(even & within(-slope), 2 * WHOLE)
    first, last = max(shift, 0), min(shift + other.shape[1], left.shape[1])
    return slice(first, last), disparity[:, first - shift : last - shift], valid[:, first - shift : last - shift]


def columns_tried(params: MatchParams) -> int:
    """Number of matches tried for each column; a multiple of 16."""
    return max(int(TRIED * params.num_disparities) // 16, 1) * 16


def halves(wider: UInt8[np.ndarray, "H W"], other: UInt8[np.ndarray, "H W"], tried: int, offset: int):
    """The wider image at half its width, the same with a margin, the part of the other image that may match it, and the
    column where that begins. All are halved down.

    For a wall along the axis of the cameras, column u of the halved image is W / 4 columns farther right in the other.

    Args:
      tried: [px] columns tried for each.
      offset: [px] shift of these for cameras that squint.
    """
    wide = wider.shape[1] // 2
    narrow = cv2.resize(wider, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    other = cv2.resize(other, None, fx=1, fy=0.5, interpolation=cv2.INTER_AREA)
    shift = wide // 2 - tried // 2 + offset
    before, after = max(-shift, 0), max(shift + wide + tried - other.shape[1], 0)
    other = cv2.copyMakeBorder(other, 0, 0, before, after, cv2.BORDER_REPLICATE)
    start = max(shift, 0)
    padded = cv2.copyMakeBorder(narrow, 0, 0, 0, tried, cv2.BORDER_REPLICATE)
    return narrow, padded, np.ascontiguousarray(other[:, start : start + wide + tried]), shift


def slopes(
    disparity: Float32[np.ndarray, "h w"], valid: Bool[np.ndarray, "h w"], reach: int
) -> tuple[Float32[np.ndarray, "h w"], Bool[np.ndarray, "h w"]]:
    """Slope of disparity [px/px of the left image] across, and where it is defined on both sides, both up or down.

    Args:
      reach: columns to each side; `REACH` pixels of the left image.
    """
    step, there = np.zeros_like(disparity), np.zeros_like(valid)
    step[:, reach:] = (disparity[:, reach:] - disparity[:, :-reach]) / REACH
    there[:, reach:] = valid[:, reach:] & valid[:, :-reach]
    slope, even = np.zeros_like(step), np.zeros_like(there)
    slope[:, :-reach] = (step[:, :-reach] + step[:, reach:]) / 2
    even[:, :-reach] = there[:, :-reach] & there[:, reach:] & (step[:, :-reach] * step[:, reach:] > 0)
    return slope, even


def within(stretch: Float32[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    return (stretch > STRETCHES[0]) & (stretch < STRETCHES[1])


def inside(column: Float32[np.ndarray, "..."], width: int) -> Bool[np.ndarray, "..."]:
    return (column >= 0) & (column <= width - 1)


def whole(mask: Bool[np.ndarray, "h w"], columns: int) -> Bool[np.ndarray, "h w"]:
    """A mask without regions thinner than `WHOLE` rows, or this many columns."""
    return cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, np.ones((WHOLE, columns), np.uint8)).astype(bool)
