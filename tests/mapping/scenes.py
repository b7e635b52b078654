"""Small worlds to look at: views of exact points, and the pieces every mapping test needs."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from jaxbiped.geometry.pose import Pose
from jaxbiped.mapping.config import MapConfig
from jaxbiped.mapping.grid import Body, GridSpec
from jaxbiped.sensing.view import View

SPEC = GridSpec()
PARAMS = MapConfig().params()
BODY = Body(*(jnp.float32(v) for v in (0.10, 0.385, 0.34, 0.03, 0.002, 0.010)))
ORIGIN = Pose(*(jnp.float32(0),) * 4)
CAP = 24_000  # points of every view, so that one compiled function serves all scenes


def pose(x=0.0, y=0.0, z=0.0, yaw=0.0):
    return Pose(*(jnp.float32(v) for v in (x, y, z, yaw)))


def view(points, weight=16.0):
    """A `View` of world points [n, 3] as seen from the origin, padded with slots of weight 0."""
    points = np.asarray(points, np.float32).reshape(-1, 3)
    assert len(points) <= CAP
    full = np.zeros((CAP, 4), np.float32)
    full[: len(points), :3], full[: len(points), 3] = points, weight
    return View(*(jnp.asarray(full[:, k]) for k in range(4)))


def plane(x, y, z, step=0.01):
    """Points of the level rectangle x = (x0, x1), y = (y0, y1) at height z."""
    xs, ys = np.arange(x[0] + step / 2, x[1], step), np.arange(y[0] + step / 2, y[1], step)
    grid = np.stack(np.meshgrid(xs, ys), -1).reshape(-1, 2)
    return np.column_stack([grid, np.full(len(grid), z)])


def wall(x, y, z, step=0.01):
    """Points of the upright rectangle from (x0, y0) to (x1, y1) between heights z = (z0, z1)."""
    length = np.hypot(x[1] - x[0], y[1] - y[0])
    along = np.arange(step / 2, length, step) / length
    up = np.arange(z[0] + step / 2, z[1], step)
    a, h = (v.ravel() for v in np.meshgrid(along, up))
    return np.column_stack([x[0] + a * (x[1] - x[0]), y[0] + a * (y[1] - y[0]), h])
