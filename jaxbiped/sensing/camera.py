"""The stereo camera on the robot: its parameters, its rays and its pose.

Camera frame: x right, y down, z along the optical axis, origin at the left camera's centre. Rays have z = 1, so that
their parameter is the depth, and disparity = focal * baseline / depth. (Paper, 3.1: Bumblebee 2, 512 x 384, 12 cm.)
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxbiped.core import checks
from jaxbiped.errors import InputError
from jaxbiped.geometry.pose import Pose
from jaxbiped.geometry.small import matrix, product

LEAST = 1e-6  # smallest value of positive parameters


@dataclass(frozen=True)
class ImageSpec:
    """Pixels of the image and the rays that represent them; static, since it sets array shapes.

    Rays go through the centres of equal blocks of pixels. Pixel (0, 0) has its centre at (0, 0) and the
    principal point is the middle of the image.

    Raises:
      InputError: a field that is not an integer of 1 or more, or more rays than pixels.
    """

    width: int = 512  # [px]
    height: int = 384  # [px]
    columns: int = 64  # rays across
    rows: int = 48  # rays down

    def __post_init__(self):
        for rays, pixels in (("columns", "width"), ("rows", "height")):
            most = checks.whole_number(pixels, getattr(self, pixels), 1)
            if checks.whole_number(rays, getattr(self, rays), 1) > most:
                message = f"must be at most the {pixels} of {most} pixels"
                raise InputError(message, field=rays, value=getattr(self, rays))

    @property
    def axis_sizes(self) -> dict[str, int]:
        """Axis sizes of arrays with a value for each ray."""
        return {"rows": self.rows, "columns": self.columns}

    @property
    def stride(self) -> tuple[float, float]:
        """Pixels from one ray to the next, across and down."""
        return self.width / self.columns, self.height / self.rows

    @property
    def pixels_per_ray(self) -> float:
        """Weight of one ray."""
        return self.width * self.height / (self.columns * self.rows)

    @cached_property
    def u(self) -> Float[np.ndarray, "columns"]:
        """[px] Column of each ray."""
        return ((np.arange(self.columns) + 0.5) * self.stride[0] - 0.5).astype(np.float32)

    @cached_property
    def v(self) -> Float[np.ndarray, "rows"]:
        """[px] Row of each ray."""
        return ((np.arange(self.rows) + 0.5) * self.stride[1] - 0.5).astype(np.float32)

    @property
    def centre(self) -> tuple[float, float]:
        """[px] Principal point (u, v)."""
        return (self.width - 1) / 2, (self.height - 1) / 2


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Camera:
    """The parameters of the camera that a sweep may change. All traced."""

    focal: Float[Array, "*B"]  # [px]
    baseline: Float[Array, "*B"]  # [m]
    pitch: Float[Array, "*B"]  # [rad] below the horizon
    look_pitch: Float[Array, "*B"]  # [rad] below the horizon when looking at the feet
    height: Float[Array, "*B"]  # [m] of the optical centre above the supporting surface, standing
    squat_drop: Float[Array, "*B"]  # [m] how much lower the camera is when squatting
    forward: Float[Array, "*B"]  # [m] of the optical centre ahead of the robot's vertical axis
    max_disparity: Float[Array, "*B"]  # [px] nearer surfaces cannot be matched


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Mount:
    """The believed pose of the camera at a moment: in the robot's vertical plane of symmetry, pitched down."""

    pitch: Float[Array, "*B"]  # [rad]
    height: Float[Array, "*B"]  # [m]
    forward: Float[Array, "*B"]  # [m]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class MountedCamera:
    """A camera on the robot, as it measures."""

    camera: Camera
    at: Mount
    image: ImageSpec = field(metadata={"static": True})


def check_camera(camera: Camera) -> None:
    """Check the parameters of a camera, if they are concrete.

    Raises:
      InputError: a number that is not finite; a focal length, baseline, or range of disparities that is not above 0.
    """
    for number in fields(camera):
        above = number.name in ("focal", "baseline", "max_disparity")
        checks.finite(f"camera.{number.name}", getattr(camera, number.name), LEAST if above else -np.inf)


def mount(camera: Camera, look: Bool[Array, ""] | bool = False, squat: Bool[Array, ""] | bool = False) -> Mount:
    """The camera's pose: `look` tilts it to the feet, `squat` lowers it."""
    return Mount(
        pitch=jnp.where(look, camera.look_pitch, camera.pitch),
        height=camera.height - jnp.where(squat, camera.squat_drop, 0.0),
        forward=camera.forward,
    )


def rays(camera: Camera, image: ImageSpec) -> tuple[Float[Array, "columns"], Float[Array, "rows"]]:
    """Camera-frame x of each ray column and y of each ray row, at z = 1."""
    return (image.u - image.centre[0]) / camera.focal, (image.v - image.centre[1]) / camera.focal


def T_robot_camera(at: Mount) -> Float[Array, "4 4"]:
    """The rigid transform that takes camera-frame points to the robot frame."""
    cos, sin, zero, one = jnp.cos(at.pitch), jnp.sin(at.pitch), jnp.zeros_like(at.pitch), jnp.ones_like(at.pitch)
    rows = (
        (zero, -sin, cos, at.forward),
        (-one, zero, zero, zero),
        (zero, -cos, -sin, at.height),
        (zero, zero, zero, one),
    )
    return matrix(rows)


def tilt(roll: Float[Array, ""], pitch: Float[Array, ""]) -> Float[Array, "3 3"]:
    """Rotation of the robot about its footprint: `roll` [rad] to the right, then `pitch` [rad] forward and down."""
    cr, sr, cp, sp = jnp.cos(roll), jnp.sin(roll), jnp.cos(pitch), jnp.sin(pitch)
    zero = jnp.zeros_like(cr)
    return matrix(((cp, sp * sr, sp * cr), (zero, cr, -sr), (-sp, cp * sr, cp * cr)))


def placed(
    pose: Pose, at: Mount, roll: Float[Array, ""], pitch: Float[Array, ""]
) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
    """Optical centre [m] and rotation of the camera in the world, for a robot tilted by roll and pitch [rad]."""
    cos, sin, zero, one = jnp.cos(pose.yaw), jnp.sin(pose.yaw), jnp.zeros_like(pose.yaw), jnp.ones_like(pose.yaw)
    R_world_level = matrix(((cos, -sin, zero), (sin, cos, zero), (zero, zero, one)))
    R_world_robot = product(R_world_level, tilt(roll, pitch))
    T = T_robot_camera(at)
    shift = product(R_world_robot, T[:3, 3:])[:, 0]
    return jnp.stack([pose.x, pose.y, pose.z]) + shift, product(R_world_robot, T[:3, :3])
