"""Rectification: from pictures of two real cameras to those of two perfect, parallel ones."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float

from jaxbiped.errors import InputError
from jaxbiped.stereo.calibration import PoseConfig, RawConfig, RectifiedConfig, StereoCamera
from jaxbiped.stereo.matching import size


@dataclass(frozen=True)
class Rig:
    """A calibrated pair, ready for measurements."""

    camera: StereoCamera  # of the rectified pictures
    maps: tuple[np.ndarray, ...] | None  # left (x, y) and right (x, y), for `cv2.remap`; None: already rectified
    R_rectified_left: Float[np.ndarray, "3 3"]  # the left camera's frame to the rectified one
    num_disparities: int | None = None  # [px] suitable for the scene
    pose: PoseConfig | None = None  # of the left camera

    @property
    def up(self) -> Float[np.ndarray, "3"] | None:
        """The direction opposite to gravity, in the rectified frame, if the pose is known."""
        return None if self.pose is None else self.R_rectified_left @ self.pose.up

    def rectify(self, left: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rectified pictures [H, W] or [H, W, 3] of a raw pair.

        Raises:
          InputError: pictures of different size, or not of the calibrated size.
        """
        width, height = self.camera.size
        for image, field in ((left, "left"), (right, "right")):
            if image.shape[:2] != (height, width):
                message = f"must be {width} x {height} px, as the camera file says"
                raise InputError(message, field=field, value=size(image))
        if self.maps is None:
            return left, right
        return tuple(
            cv2.remap(image, *maps, cv2.INTER_LINEAR) for image, maps in ((left, self.maps[:2]), (right, self.maps[2:]))
        )


def make_rig(config: RectifiedConfig | RawConfig) -> Rig:
    """A rig from its calibration.

    Raises:
      InputError: distortions so strong that no picture is left.
    """
    if isinstance(config, RectifiedConfig):
        return Rig(config.camera(), None, np.eye(3), config.num_disparities, config.pose)
    shape = config.width, config.height
    lenses = [(lens.matrix, np.array(lens.distortion or (0.0,) * 4)) for lens in (config.left, config.right)]
    R, T = np.array(config.rotation), np.array(config.translation)[:, None]
    R_left, R_right, P_left, P_right, *_ = cv2.stereoRectify(
        *lenses[0], *lenses[1], shape, R, T, flags=cv2.CALIB_ZERO_DISPARITY, alpha=0
    )
    with np.errstate(all="ignore"):
        focal, baseline = float(P_left[0, 0]), float(-P_right[0, 3] / P_right[0, 0])
    if not (np.isfinite([focal, baseline]).all() and 0.05 * config.width <= focal <= 100 * config.width):
        message = "cannot be rectified: its lenses or its rotation leave no common picture"
        raise InputError(message, field="camera", value=f"focal length of {focal:.3g} px after rectification")
    maps = []
    for lens, rotation, projection in ((lenses[0], R_left, P_left), (lenses[1], R_right, P_right)):
        maps += cv2.initUndistortRectifyMap(*lens, rotation, projection, shape, cv2.CV_32FC1)
    camera = StereoCamera(
        focal,
        (float(P_left[0, 2]), float(P_left[1, 2])),
        baseline,
        shape,
        float(P_right[0, 2] - P_left[0, 2]),
    )
    return Rig(camera, tuple(maps), R_left, config.num_disparities, config.pose)
