"""The ray-cast stereo camera: true depth of boxes, floor and terrain, as a stereo matcher would measure it."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int32, UInt32

from jaxbiped.arenas.arena import Arena
from jaxbiped.arenas.ground import cast_ground
from jaxbiped.core.signatures import checked
from jaxbiped.geometry.pose import Pose
from jaxbiped.geometry.rays import cast_boxes, key, marked, nearness
from jaxbiped.sensing import noise as stereo
from jaxbiped.sensing.camera import Camera, ImageSpec, MountedCamera, check_camera, mount, placed, rays
from jaxbiped.sensing.noise import StereoNoise
from jaxbiped.sensing.view import View


@checked(numbers=("camera", "noise"))
def measure(
    arena: Arena,
    pose: Pose,
    camera: Camera,
    noise: StereoNoise,
    image: ImageSpec,
    seed: UInt32[Array, ""],
    look: Bool[Array, ""] | bool = False,
    squat: Bool[Array, ""] | bool = False,
    attitude: tuple[Float[Array, ""], Float[Array, ""]] | None = None,
) -> View:
    """One measurement in one arena from the true `pose` (z: height of the supporting surface).

    The robot's true attitude deviates by a roll and a pitch [rad]: `attitude` if it is known, as for a simulated robot,
    else drawn from the view's seed. Points are reprojected as if it were upright (`View`). `look` tilts the camera to
    the feet, `squat` lowers it. Rays without a measurement, or with a range beyond `noise.max_range`, have weight 0 and
    are at the origin; so are all if the pose is not finite.

    Ray hits are found by comparing bits, so derivatives do not show how points move with the pose or the boxes: use
    differences of measurements with one seed, or `measure_oracle`.

    Raises:
      InputError: an argument of another rank, shape or type, a camera that `check_camera` rejects, NaN in `noise`.
    """
    check_camera(camera)
    eye = MountedCamera(camera, mount(camera, look, squat), image)
    textured = arena.boxes.contrast >= noise.min_contrast, arena.floor_contrast >= noise.min_contrast
    attitude = stereo.attitude_error(noise, seed) if attitude is None else attitude
    keys = cast(arena, pose, eye, attitude, *textured)
    disparity = nearness(keys) * (camera.focal * camera.baseline)
    disparity = stereo.match(disparity, marked(keys)[1:-1, 1:-1], camera, image, noise, seed)
    return reproject(disparity, eye, noise.max_range)


def cast(
    arena: Arena,
    pose: Pose,
    eye: MountedCamera,
    attitude: tuple[Float[Array, ""], Float[Array, ""]],
    box_marks: Bool[Array, "M"],
    floor_mark: Bool[Array, ""],
) -> Int32[Array, "padded_rows padded_columns"]:
    """The hit of each ray, and of a margin of one ray around: inverse depth [1/m] and a mark (`geometry.rays.key`).

    Inverse depth is along the optical axis, and 0 where a ray leaves the arena: there is nothing beyond its rectangle.
    """
    image = eye.image
    origin, basis = placed(pose, eye.at, *attitude)
    x, y = (values.reshape(-1) / eye.camera.focal for values in np.meshgrid(*margin(image)))
    floor = key(cast_ground(arena, origin, basis, x, y), floor_mark)
    keys = cast_boxes(arena.boxes, box_marks, origin, basis, x, y, floor)
    return keys.reshape(image.rows + 2, image.columns + 2)


def margin(image: ImageSpec) -> tuple[Float[np.ndarray, "padded_columns"], Float[np.ndarray, "padded_rows"]]:
    """[px] columns and rows of the rays from the principal point, with one more on each side."""
    return tuple(
        np.concatenate([values[:1] - step, values, values[-1:] + step]).astype(np.float32) - np.float32(middle)
        for values, step, middle in zip((image.u, image.v), image.stride, image.centre, strict=True)
    )


def reproject(disparity: Float[Array, "rows columns"], eye: MountedCamera, max_range: Float[Array, ""] | float) -> View:
    """Points in the robot frame for disparities [px] (0: not measured), for a robot that stands upright."""
    camera, at, image = eye.camera, eye.at, eye.image
    # All from the quotient, in flat vectors: XLA then keeps it, and does not match or shuffle again for each result.
    depth = (camera.focal * camera.baseline / disparity).reshape(-1)
    x, y = (values.reshape(-1) for values in jnp.meshgrid(*rays(camera, image)))
    valid = depth * jnp.sqrt(1 + x * x + y * y) <= max_range  # false for the inf and NaN of unmeasured rays
    cos, sin = jnp.cos(at.pitch), jnp.sin(at.pitch)
    points = (at.forward + depth * (cos - sin * y), -depth * x, at.height - depth * (sin + cos * y))
    return View(*(jnp.where(valid, axis, 0.0) for axis in points), weight=jnp.where(valid, image.pixels_per_ray, 0.0))
