"""What must be known of a rectified pair of cameras to turn disparities into metres."""

from __future__ import annotations

from dataclasses import dataclass

from jaxbiped.sensing.camera import CameraConfig


@dataclass(frozen=True)
class StereoCamera:
    """A rectified pair. Pixel (0, 0) has its centre at (0, 0). Camera frame: x right, y down, z ahead, left camera."""

    focal: float  # [px]
    centre: tuple[float, float]  # [px] principal point (u, v) of the left image
    baseline: float  # [m]
    size: tuple[int, int]  # [px] (width, height)
    doffs: float = 0.0  # [px] column of the right principal point less that of the left; 0 for parallel cameras


def ideal(camera: CameraConfig) -> StereoCamera:
    """The perfect camera of a camera file of the robot, as it is rendered."""
    return StereoCamera(camera.focal, camera.image.centre, camera.baseline, (camera.width, camera.height))
