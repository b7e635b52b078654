"""The calibration of a pair of cameras, for converting pictures to metres: models, limits, and the file in TOML."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import Field, model_validator

from jaxbiped.config import Model
from jaxbiped.core import checks
from jaxbiped.core.signatures import checked
from jaxbiped.errors import InputError
from jaxbiped.sensing.config import CameraConfig

Pixels = Annotated[int, Field(ge=16, le=16384)]
Baseline = Annotated[float, Field(ge=0.001, le=2.0)]  # [m]; otherwise the file is in other units
LEAST = 1e-9  # smallest value of positive parameters
DISTORTIONS = (0, 4, 5, 8, 12, 14)  # numbers of coefficients that OpenCV supports


@dataclass(frozen=True)
class StereoCamera:
    """A rectified pair. Pixel (0, 0) has its centre at (0, 0). Camera frame: x right, y down, z ahead, left camera.

    Raises:
      InputError: a number that is not finite, no focal length or baseline above 0, or a size that is not positive.
    """

    focal: float  # [px]
    centre: tuple[float, float]  # [px] principal point (u, v) of the left image
    baseline: float  # [m]
    size: tuple[int, int]  # [px] (width, height)
    doffs: float = 0.0  # [px] column of the right principal point minus that of the left; 0 for parallel cameras

    def __post_init__(self):
        for name, least in (("focal", LEAST), ("baseline", LEAST), ("centre", -np.inf), ("doffs", -np.inf)):
            checks.finite(name, getattr(self, name), least)
        for name in ("centre", "size"):
            if len(np.shape(getattr(self, name))) != 1 or len(getattr(self, name)) != 2:
                raise InputError("must be two numbers", field=name, value=getattr(self, name))
        for pixels in self.size:
            checks.whole_number("size", pixels, 1)


@checked()
def ideal(camera: CameraConfig) -> StereoCamera:
    """The perfect camera for a camera file of the robot, as it is rendered."""
    return StereoCamera(camera.focal, camera.image.centre, camera.baseline, (camera.width, camera.height))


class PoseConfig(Model):
    """The pose of the left camera. Missing values are found from the floor in view."""

    pitch: float = Field(ge=-45, le=90)
    """[deg] Below the horizon."""
    roll: float = Field(0.0, ge=-180, le=180)
    """[deg] To the right."""
    height: float | None = Field(None, gt=0, le=100)
    """[m] Height of the optical centre above the floor."""

    @property
    def up(self) -> Float[np.ndarray, "3"]:
        """The direction opposite to gravity in the frame of the left camera (x right, y down, z ahead)."""
        pitch, roll = math.radians(self.pitch), math.radians(self.roll)
        return np.array([-math.sin(roll) * math.cos(pitch), -math.cos(roll) * math.cos(pitch), -math.sin(pitch)])


class RectifiedConfig(Model):
    """A pair with rectified pictures: same rows, no distortion."""

    width: Pixels
    """[px]"""
    height: Pixels
    """[px]"""
    focal: float = Field(gt=0)
    """[px]"""
    cx: float
    """[px] Column of the left principal point."""
    cy: float
    """[px] Row of the principal point."""
    baseline: Baseline
    """[m]"""
    doffs: float = 0.0
    """[px] Column of the right principal point minus that of the left."""
    num_disparities: int | None = Field(None, ge=16, le=2048, multiple_of=16)
    """[px] Suitable search range for the scene."""
    pose: PoseConfig | None = None
    """The camera's pose, if known."""

    @model_validator(mode="after")
    def check_whole(self) -> RectifiedConfig:
        check_lens("", self.focal, self.cx, self.cy, self.width, self.height)
        if not abs(self.doffs) < self.width:
            raise ValueError(f"doffs must be less than the width of {self.width} px, got {self.doffs:g}")
        return self

    def camera(self) -> StereoCamera:
        """The same, for `points`."""
        return StereoCamera(self.focal, (self.cx, self.cy), self.baseline, (self.width, self.height), self.doffs)


class LensConfig(Model):
    """One camera, as calibrated by OpenCV."""

    focal: tuple[float, float]
    """[px] Across and down."""
    centre: tuple[float, float]
    """[px] Principal point: column, row."""
    distortion: tuple[float, ...] = ()
    """k1, k2, p1, p2, k3, ...: none, 4, 5, 8, 12 or 14 of them."""

    @model_validator(mode="after")
    def check_count(self) -> LensConfig:
        if len(self.distortion) not in DISTORTIONS:
            raise ValueError(f"distortion must hold 0, 4, 5, 8, 12 or 14 numbers, got {len(self.distortion)}")
        return self

    @property
    def matrix(self) -> Float[np.ndarray, "3 3"]:
        """The pinhole matrix."""
        return np.array([[self.focal[0], 0, self.centre[0]], [0, self.focal[1], self.centre[1]], [0, 0, 1]])


class RawConfig(Model):
    """A pair of raw pictures, to be rectified: p_right = rotation p_left + translation, as in OpenCV."""

    width: Pixels
    """[px]"""
    height: Pixels
    """[px]"""
    left: LensConfig
    right: LensConfig
    rotation: tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
    """Matrix, row by row."""
    translation: tuple[float, float, float]
    """[m]; the first is below 0: the right camera is on the right."""
    num_disparities: int | None = Field(None, ge=16, le=2048, multiple_of=16)
    """[px] Suitable search range for the scene."""
    pose: PoseConfig | None = None
    """The left camera's pose, if known."""

    @model_validator(mode="after")
    def check_whole(self) -> RawConfig:
        for side in ("left", "right"):
            lens = getattr(self, side)
            for focal in lens.focal:
                check_lens(f"{side}.", focal, *lens.centre, self.width, self.height)
        R, T = np.array(self.rotation), np.array(self.translation)
        if np.abs(R @ R.T - np.eye(3)).max() > 1e-3 or np.linalg.det(R) < 0:
            raise ValueError("rotation must be a rotation matrix, row by row")
        if (np.trace(R) - 1) / 2 < math.cos(math.radians(45)):
            raise ValueError("rotation must be below 45 degrees: the cameras must look the same way")
        if not 0.001 <= np.linalg.norm(T) <= 2:
            raise ValueError(f"translation must be 0.001 to 2 m long (in metres), got {np.linalg.norm(T):g}")
        if not -T[0] > 0.7 * np.linalg.norm(T):
            raise ValueError("translation must be along -x: the right camera to the right of the left one")
        return self


def check_lens(prefix: str, focal: float, cx: float, cy: float, width: int, height: int) -> None:
    """Raise `ValueError` unless the parameters are plausible."""
    if not 0.1 * width <= focal <= 50 * width:
        raise ValueError(
            f"{prefix}focal must be in pixels, {0.1 * width:g} to {50 * width:g} for a width of {width}, got {focal:g}"
        )
    for name, value, side in (("cx", cx, width), ("cy", cy, height)):
        if not -side <= value <= 2 * side:
            raise ValueError(f"{prefix}{name} must be in pixels, near the image's {side}, got {value:g}")
