"""The landmarks visible in a view, and their measured positions.

Measurement is modelled, not imaged: a landmark that is in both images, in range and not behind a box or terrain is
found, and its centre has a normal error that grows with range. Correspondence is known (paper, 2, condition 2: sizes
and positions of landmarks are known). The yaw of a square, known modulo 90 degrees, is not used. On terrain a
landmark lies at the height of the ground.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, UInt32

from jaxbiped.arenas.arena import CIRCLE, SQUARE, Arena
from jaxbiped.arenas.ground import cast_ground, ground_height
from jaxbiped.core import checks
from jaxbiped.core.signatures import checked
from jaxbiped.geometry.pose import Pose, to_robot
from jaxbiped.geometry.rays import cast_boxes, key, nearness
from jaxbiped.sensing import counter_rng
from jaxbiped.sensing.camera import Camera, ImageSpec, check_camera, mount, placed
from jaxbiped.sensing.view import Sightings

LANDMARK = 4  # channel of a view's seed
HIDDEN_MARGIN = 1e-3  # relative: a box, or the ground, that only touches the landmark does not hide it


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class LandmarkNoise:
    """All traced; see `LandmarkConfig` for what each is."""

    sd: Float[Array, "*B"]
    sd_per_metre: Float[Array, "*B"]
    nearest: Float[Array, "*B"]
    furthest_circle: Float[Array, "*B"]
    furthest_square: Float[Array, "*B"]


@checked(numbers=("camera", "noise"))
def sight(
    arena: Arena,
    pose: Pose,
    camera: Camera,
    noise: LandmarkNoise,
    image: ImageSpec,
    seed: UInt32[Array, ""],
    look: Bool[Array, ""] | bool = False,
    squat: Bool[Array, ""] | bool = False,
) -> Sightings:
    """Landmarks of one arena as seen from the true `pose`; the channel LANDMARK of the view's `seed` is used.

    Unseen ones are at the origin; none is seen from a pose that is not finite. Under `jit`, any kind that is not
    `SQUARE` is a circle.

    Raises:
      InputError: an argument of another rank, shape or type, an unknown kind, a camera that `check_camera` rejects,
        NaN in `noise`.
    """
    check_camera(camera)
    checks.integers("arena.landmarks.kind", arena.landmarks.kind, between=(CIRCLE, SQUARE))
    marks = arena.landmarks
    level = jnp.zeros_like(pose.yaw)
    origin, basis = placed(pose, mount(camera, look, squat), level, level)
    on_ground = jnp.zeros_like(marks.x) if arena.terrain is None else ground_height(arena, marks.x, marks.y)
    offset = jnp.stack([marks.x, marks.y, on_ground]) - origin[:, None]
    right, down, depth = (jnp.sum(basis[:, i, None] * offset, axis=0) for i in range(3))  # camera frame
    x, y = right / depth, down / depth
    u, v = camera.focal * x + image.centre[0], camera.focal * y + image.centre[1]
    disparity = camera.focal * camera.baseline / depth
    in_view = (depth > 0) & (disparity <= camera.max_disparity) & (v >= 0) & (v <= image.height - 1)
    in_view = in_view & (u - disparity >= 0) & (u <= image.width - 1)
    behind = jnp.zeros(x.shape, jnp.int32)
    if arena.terrain is not None:
        behind = key(cast_ground(arena, origin, basis, x, y), jnp.zeros((), bool))
    before = cast_boxes(arena.boxes, jnp.zeros_like(arena.boxes.used), origin, basis, x, y, behind)
    hidden = nearness(before) * depth > 1 + HIDDEN_MARGIN
    forward, left = to_robot(pose, marks.x, marks.y)
    distance = jnp.sqrt(forward * forward + left * left)
    furthest = jnp.where(marks.kind == SQUARE, noise.furthest_square, noise.furthest_circle)
    seen = marks.used & in_view & ~hidden & (distance >= noise.nearest) & (distance <= furthest)
    sd = noise.sd + noise.sd_per_metre * distance
    error = counter_rng.normal(seed, np.arange(2 * marks.x.shape[0]), LANDMARK).reshape(2, -1) * sd
    return Sightings(
        x=jnp.where(seen, forward + error[0], 0.0),
        y=jnp.where(seen, left + error[1], 0.0),
        sd=jnp.where(seen, sd, 0.0),
        seen=seen,
    )
