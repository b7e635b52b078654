"""Visual odometry of the ray-cast sensor: the robot's own motion from one view to the next.

`stereo.tracking` measures it in pictures. This is a model of it: it uses points that both views show, and has errors
of the size found in rendered pictures.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, UInt32

from jaxbiped.core.signatures import checked
from jaxbiped.geometry.pose import Pose, to_robot, to_world, wrap_angle
from jaxbiped.sensing import counter_rng
from jaxbiped.sensing.camera import Camera, ImageSpec, Mount, MountedCamera
from jaxbiped.sensing.view import Motion, View

VISUAL = 6  # channel of a view's seed
LEAST_SHARE = 1e-4  # of the image, in both views: keeps the model's division finite if nothing is


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class VisualNoise:
    """All traced; see `VisualConfig` for what each is. Angles in radians."""

    forward: Float[Array, "*B"]
    left: Float[Array, "*B"]
    yaw: Float[Array, "*B"]
    least_share: Float[Array, "*B"]
    failure: Float[Array, "*B"]


SHARE = 0.1  # of the image: share for which the standard deviations of `VisualConfig` hold


def nothing() -> Motion:
    """No motion measured."""
    zero = jnp.zeros(())
    return Motion(zero, zero, zero, jnp.zeros((3, 3)), jnp.zeros((), bool))


@checked(numbers=("at", "camera", "noise", "max_range"))
def track(
    view: View,
    pose: Pose,
    before: Pose,
    at: Mount,
    camera: Camera,
    noise: VisualNoise,
    image: ImageSpec,
    max_range: Float[Array, ""] | float,
    seed: UInt32[Array, ""],
) -> Motion:
    """The motion from the true pose `before`, of the last view, to the true `pose` of this one.

    Modelled, not imaged. The channel VISUAL of this view's `seed` is used.

    Args:
      view: this view; its points are textured, since they were matched.
      at: the camera's pose on the robot in the last view.
      max_range: [m] from the camera; points beyond are not measured.
    """
    share = overlap(view, pose, before, MountedCamera(camera, at, image), max_range)
    shrink = jnp.sqrt(SHARE / jnp.maximum(share, LEAST_SHARE))
    sd = jnp.stack([noise.forward, noise.left, noise.yaw]) * shrink
    error = sd * counter_rng.normal(seed, np.arange(3), VISUAL)
    lucky = counter_rng.uniform(seed, 3, VISUAL) >= noise.failure
    x, y = to_robot(before, pose.x, pose.y)
    yaw = wrap_angle(pose.yaw - before.yaw)
    seen = (share >= noise.least_share) & lucky & jnp.isfinite(x + y + yaw)
    found = Motion(x + error[0], y + error[1], yaw + error[2], jnp.diag(sd * sd), seen)
    return jax.tree.map(lambda new, none: jnp.where(seen, new, none), found, nothing())


def overlap(
    view: View,
    pose: Pose,
    before: Pose,
    eye: MountedCamera,
    max_range: Float[Array, ""] | float,
) -> Float[Array, ""]:
    """Share of the image's pixels whose points are also measured by the camera at `before`.

    Occlusion from there is not checked.
    """
    camera, at, image = eye.camera, eye.at, eye.image
    x, y = to_robot(before, *to_world(pose, view.x, view.y))
    z = view.z + pose.z - before.z
    ahead, up = x - at.forward, z - at.height
    cos, sin = jnp.cos(at.pitch), jnp.sin(at.pitch)
    depth, down = cos * ahead - sin * up, -sin * ahead - cos * up
    u, v = -camera.focal * y / depth + image.centre[0], camera.focal * down / depth + image.centre[1]
    disparity = camera.focal * camera.baseline / depth
    there = (depth > 0) & (disparity <= camera.max_disparity) & (v >= 0) & (v <= image.height - 1)
    there = there & (u >= disparity) & (u <= image.width - 1) & (view.weight > 0)
    there = there & (ahead * ahead + y * y + up * up <= max_range * max_range)
    return jnp.sum(jnp.where(there, view.weight, 0.0)) / (image.width * image.height)
