"""From disparity to points: reprojection by a rectified camera."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float32

from jaxbiped.core.signatures import checked
from jaxbiped.errors import InputError
from jaxbiped.stereo.calibration import StereoCamera
from jaxbiped.stereo.matching import Disparity

LEAST = 1.0 / 16  # [px] smallest disparity for which a distance is computed
USEFUL = 2.0, 27.2  # [m] range of maps with the paper's camera, and its focal length times baseline [px m]


class Points(NamedTuple):
    """Points of one pair, one for each pixel of the left image, row by row, in the camera frame."""

    x: Float32[np.ndarray, "N"]  # [m] right
    y: Float32[np.ndarray, "N"]  # [m] down
    z: Float32[np.ndarray, "N"]  # [m] ahead
    weight: Float32[np.ndarray, "N"]  # pixels: 1, or 0 where nothing was measured; such points are at the origin


@checked()
def to_points(disparity: Disparity, camera: StereoCamera) -> Points:
    """Points of a disparity image: z = focal * baseline / (d + doffs), x = (u - cu) z / focal, y = (v - cv) z / focal.

    N = H W, always. Disparities that are not valid, not finite, or below 1/16 px of parallax have weight 0.

    Raises:
      InputError: the image does not have the camera's size, or arrays of another shape or type.
    """
    height, width = disparity.value.shape
    if (width, height) != tuple(camera.size):
        message = f"must be {camera.size[0]} x {camera.size[1]} px, as in the camera file"
        raise InputError(message, field="image", value=f"{width} x {height}")
    parallax = disparity.value + np.float32(camera.doffs)
    known = disparity.valid & (parallax >= LEAST) & (parallax < np.inf)
    z = np.float32(camera.focal * camera.baseline) * known / np.where(known, parallax, np.float32(1))
    x = ((np.arange(width) - camera.centre[0]) / camera.focal).astype(np.float32) * z
    y = ((np.arange(height) - camera.centre[1]) / camera.focal).astype(np.float32)[:, None] * z
    return Points(*(values.reshape(-1) for values in (x, y, z, known.astype(np.float32))))


def useful_range(camera: StereoCamera) -> float:
    """[m] Range at which depth is as uncertain as at 2 m in the paper's camera: depth noise grows as z^2 / (f b)."""
    return USEFUL[0] * math.sqrt(camera.focal * camera.baseline / USEFUL[1])
