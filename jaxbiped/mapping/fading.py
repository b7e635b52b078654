"""A map that forgets: what a camera should see again and does not, and votes that grow old, for obstacles that move.

Not in the paper, whose map only ever gathers. Two things fade, both by exp(-t / `MapConfig.fade`) where t is the time
since the measurement before: the evidence of a voxel that both cameras have in view and that nothing hides, but where
the new view measured nothing; and the votes of the cells that the new view measures, or of which a voxel fades. A place
that the view does not tell of is kept as it is: the lintel of a gate that is too near to be in view, for one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.geometry.pose import Pose, to_robot
from jaxbiped.mapping.grid import GridSpec, flat_index
from jaxbiped.sensing.camera import MountedCamera, T_robot_camera
from jaxbiped.sensing.view import View

if TYPE_CHECKING:
    from jaxbiped.mapping.gridmap import GridMap

HIDDEN = 0.05  # [m] by which something lies nearer than what it hides: the size of a voxel, and noise of depth


@dataclass(frozen=True)
class Eye:
    """What a view was measured by, and how much of what was before is kept where it tells otherwise."""

    camera: MountedCamera
    keep: Float[Array, ""]  # 0 to 1


def forget(
    grid_map: GridMap, view: View, points: Float[Array, "H W Z"], pose: Pose, eye: Eye, spec: GridSpec
) -> GridMap:
    """The map of one arena without what one more view makes old; see above.

    Args:
      view: brought level, in the robot frame.
      points: its pixels in each voxel.
    """
    gone = missed(view, points, pose, eye.camera, spec) & (grid_map.evidence > 0)
    kept = jnp.where(jnp.any(gone | (points > 0), axis=-1), eye.keep, 1.0)[..., None]
    left = jnp.where(gone, eye.keep, 1.0)
    grounds = jnp.moveaxis(left[..., -spec.lowest : spec.ground_levels - spec.lowest], -1, 0)
    return replace(
        grid_map,
        evidence=grid_map.evidence * left,
        surfaces=jax.tree.map(lambda leaf: leaf * grounds, grid_map.surfaces),
        votes=grid_map.votes * kept,
        level_votes=grid_map.level_votes * kept,
    )


def missed(
    view: View,
    points: Float[Array, "H W Z"],
    pose: Pose,
    camera: MountedCamera,
    spec: GridSpec,
) -> Bool[Array, "H W Z"]:
    """The voxels that one view, brought level, should have measured if they were occupied, and has not.

    Both cameras have the centre of such a voxel in view, within the range of disparities; neither the ray nearest to it
    nor the eight around that measured anything that lies nearer than it, by `HIDDEN`; and no point lies in it. Most of
    them have nothing behind that could be measured. A view without a single point misses nothing.

    Args:
      view: points in the robot frame.
      points: the pixels of the view in each voxel.
      pose: where the robot believes to stand; `pose.z` [m] the height of its supporting surface.
    """
    far = nearest_depths(view, camera)
    height, width = spec.shape
    x, y = to_robot(
        pose, ((jnp.arange(width) + 0.5) * spec.pitch)[None], ((jnp.arange(height) + 0.5) * spec.pitch)[:, None]
    )
    z = (jnp.arange(spec.levels) + spec.lowest) * spec.level_height - pose.z
    depth, index, inside = project(*jnp.broadcast_arrays(x[..., None], y[..., None], z), camera)
    return inside & (far.reshape(-1)[index] > depth - HIDDEN) & (points == 0) & jnp.any(view.weight > 0)


def nearest_depths(view: View, camera: MountedCamera) -> Float[Array, "rows columns"]:
    """[m] least depth that a view measured by each ray and the eight around it; inf where they measured nothing."""
    image = camera.image
    depth, index, inside = project(view.x, view.y, view.z, camera)
    counts = inside & (view.weight > 0)
    flat = jnp.full(image.rows * image.columns, jnp.inf)
    flat = flat.at[jnp.where(counts, index, 0)].min(jnp.where(counts, depth, jnp.inf))
    padded = jnp.pad(flat.reshape(image.rows, image.columns), 1, constant_values=jnp.inf)
    rows = jnp.minimum(jnp.minimum(padded[:-2], padded[1:-1]), padded[2:])
    return jnp.minimum(jnp.minimum(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:])


def project(
    x: Float[Array, "*S"], y: Float[Array, "*S"], z: Float[Array, "*S"], mounted: MountedCamera
) -> tuple[Float[Array, "*S"], Int[Array, "*S"], Bool[Array, "*S"]]:
    """Depth [m] of points in the robot frame, the ray nearest to each, and whether it can be measured."""
    camera, image = mounted.camera, mounted.image
    T = T_robot_camera(mounted.at)
    dx, dy, dz = x - T[0, 3], y - T[1, 3], z - T[2, 3]
    right, down, depth = (T[0, k] * dx + T[1, k] * dy + T[2, k] * dz for k in range(3))
    near = camera.focal * camera.baseline / camera.max_disparity
    scale = camera.focal / jnp.maximum(depth, near)
    u = image.centre[0] + scale * right
    column = jnp.floor((u + 0.5) / image.stride[0])
    row = jnp.floor((image.centre[1] + scale * down + 0.5) / image.stride[1])
    inside = (depth >= near) & (column >= 0) & (column < image.columns) & (row >= 0) & (row < image.rows)
    inside &= u >= scale * camera.baseline  # the right camera has it in view, too
    return depth, flat_index(inside, (row, column), (image.rows, image.columns)), inside
