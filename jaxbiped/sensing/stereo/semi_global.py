"""OpenCV's semi-global matcher: its numbers, one search, and how far the two images agree about what it found."""

from __future__ import annotations

from typing import Literal

import cv2
import numpy as np
from jaxtyping import Float32, UInt8
from pydantic import Field, model_validator

from jaxbiped.config import Model

MODES = {
    "3way": cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    "hh": cv2.STEREO_SGBM_MODE_HH,
    "5way": cv2.STEREO_SGBM_MODE_SGBM,
}
STEPS = 16  # of OpenCV's disparities in a pixel
SMOOTH = 5  # [px]


class MatchParams(Model):
    """Numbers of the matcher, with the values found necessary on rendered and on real pairs.

    Small blocks and low prices follow what is seen at a slant. With prices four times as high mode `5way`, OpenCV's own
    default, which has no path from below, is off by 0.1 px on a floor that recedes.
    """

    num_disparities: int = Field(160, ge=16, le=2048, multiple_of=16)
    """[px] search range; sets the nearest distance that can be measured."""
    min_disparity: int = Field(0, ge=-1024, le=1024)
    """[px] least disparity; below 0 for cameras that squint (`doffs`)."""
    block_size: int = Field(3, ge=1, le=11)
    """[px] side of a block; odd."""
    p1: int = Field(30, ge=0, le=8191)
    """Price of a change of disparity by 1 px to the next pixel."""
    p2: int = Field(250, ge=1, le=8192)
    """Price of a greater change; above p1. (OpenCV sums prices in 16 bits.)"""
    pre_filter_cap: int = Field(63, ge=1, le=63)
    """Gradients beyond this are cut."""
    uniqueness: int = Field(5, ge=0, le=99)
    """[%] by which the best match must beat the next."""
    speckle_size: int = Field(200, ge=0, le=2**30)
    """[px] patches of no more pixels are dropped; 0 for none."""
    speckle_range: int = Field(2, ge=1, le=2048)
    """[px] by which disparity may change within a patch."""
    left_right: int = Field(1, ge=-1, le=2048)
    """[px] by which left and right disparities may differ; -1 for no check."""
    agreement: float = Field(0.35, ge=-1, lt=1)
    """Least correlation of the two images' gradients about a matched pixel; -1 for no check. What both images share is
    texture; what is plain shows each camera's own noise, which a matcher matches as well, and wrongly."""
    agreement_window: int = Field(15, ge=3, le=101)
    """[px] side of the window of that correlation; odd."""
    mode: Literal["3way", "hh", "5way"] = "3way"
    """Paths that are searched: 3 (fast), all 8 (3 times the time), or 5."""
    slanted: bool = True
    """Search once more for what one image shows much wider than the other, which takes as long again."""

    @model_validator(mode="after")
    def check_whole(self) -> MatchParams:
        for name in ("block_size", "agreement_window"):
            if getattr(self, name) % 2 == 0:
                raise ValueError(f"{name} must be odd, got {getattr(self, name)}")
        if self.p2 <= self.p1:
            raise ValueError(f"p2 must be above p1 ({self.p1}), got {self.p2}")
        return self


def search(left: UInt8[np.ndarray, "H W"], right: UInt8[np.ndarray, "H W"], params: MatchParams) -> np.ndarray:
    """OpenCV's disparities [H, W] int16 in sixteenths of a pixel; what it does not measure is below the least."""
    matcher = cv2.StereoSGBM_create(
        minDisparity=params.min_disparity,
        numDisparities=params.num_disparities,
        blockSize=params.block_size,
        P1=params.p1,
        P2=params.p2,
        disp12MaxDiff=params.left_right,
        preFilterCap=params.pre_filter_cap,
        uniquenessRatio=params.uniqueness,
        speckleWindowSize=params.speckle_size,
        speckleRange=params.speckle_range,
        mode=MODES[params.mode],
    )
    # OpenCV leaves out the columns whose search would leave the image: with these margins, none of ours.
    before = max(params.min_disparity + params.num_disparities, 0)
    after = max(-params.min_disparity, 0)
    left, right = (cv2.copyMakeBorder(image, 0, 0, before, after, cv2.BORDER_REPLICATE) for image in (left, right))
    found = matcher.compute(left, right)
    return np.ascontiguousarray(found[:, before : found.shape[1] - after])


def agreement(
    left: UInt8[np.ndarray, "H W"], right: UInt8[np.ndarray, "H V"], column: Float32[np.ndarray, "H W"], window: int
) -> Float32[np.ndarray, "H W"]:
    """Correlation, -1 to 1, of the images' gradients along rows, in a window about each pixel and its match.

    Matches are taken from the median of `SMOOTH` x `SMOOTH` pixels: on what is plain, a matcher finds for each pixel by
    itself where the noise of both images agrees.

    Args:
      left, right: a rectified pair; of the right one more columns may be there.
      column: [px] of the match of each left pixel in the right image.
      window: [px] side.
    """
    a, b = (cv2.Sobel(image, cv2.CV_32F, 1, 0) for image in (left, right))
    row = np.broadcast_to(np.arange(left.shape[0], dtype=np.float32)[:, None], column.shape)
    column = cv2.medianBlur(np.ascontiguousarray(column), SMOOTH)
    b = cv2.remap(b, column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)

    def mean(values):
        return cv2.boxFilter(values, -1, (window, window))

    mean_a, mean_b = mean(a), mean(b)
    shared = mean(a * b) - mean_a * mean_b
    own = (mean(a * a) - mean_a**2) * (mean(b * b) - mean_b**2)
    least = 1e-3  # far below the variance of one changed bit; images without any gradient share nothing
    return np.where(own > least, shared / np.sqrt(np.maximum(own, least)), np.float32(-1)).astype(np.float32)
