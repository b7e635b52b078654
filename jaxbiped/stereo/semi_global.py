"""OpenCV's semi-global matcher: its numbers, one search, and how far the two images agree about what it found."""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Float32, UInt8

from jaxbiped.stereo.config import MatchParams as MatchParams

MODES = {
    "3way": cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    "hh": cv2.STEREO_SGBM_MODE_HH,
    "5way": cv2.STEREO_SGBM_MODE_SGBM,
}
STEPS = 16  # of OpenCV's disparities in a pixel
SMOOTH = 5  # [px]


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
