"""First hits of rays on boxes: the kernel of the depth camera and of all occlusion tests.

Everything is computed in nearness, the inverse of a ray's parameter. Along a ray origin + t direction the nearness of a
plane is linear in the direction, so there are no divisions, and the nearest hit is the greatest. Rays are those of a
pinhole: direction = basis @ (x, y, 1), with the parameter t the depth. They are a structure of arrays, which
compilers turn into long vectors; boxes come one after another.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int32

from jaxbiped.geometry.boxes import Boxes

Rays = Float[Array, "R"] | Float[np.ndarray, "R"]

INSIDE = 1e9  # [1/m] nearness of a box that contains the origin


def cast_boxes(
    boxes: Boxes,
    marks: Bool[Array, "M"],
    origin: Float[Array, "3"],
    basis: Float[Array, "3 3"],
    x: Rays,
    y: Rays,
    background: Int32[Array, "R"],
) -> Int32[Array, "R"]:
    """Nearest intersection of a pinhole's rays with the boxes of one arena.

    Args:
      boxes: `M` slots of one arena; unused ones may hold anything.
      marks: one bit for each box, returned for the box that is hit.
      origin: common origin of the rays [m], world frame.
      basis: takes directions (x, y, 1) to the world frame.
      x: first component of each ray.
      y: second component of each ray.
      background: key of what each ray hits behind the boxes (see `key`); 0 for nothing.

    Returns:
      the key of the nearest hit; its nearness is `INSIDE` from within a box. NaN in the origin or basis hits nothing.
    """
    cos, sin, zero, one = jnp.cos(boxes.yaw), jnp.sin(boxes.yaw), jnp.zeros_like(boxes.yaw), jnp.ones_like(boxes.yaw)
    dx, dy, dz = boxes.x - origin[0], boxes.y - origin[1], (boxes.bottom + boxes.top) / 2 - origin[2]
    centre = jnp.stack([cos * dx + sin * dy, cos * dy - sin * dx, dz], axis=1)
    half = jnp.stack([boxes.half_x, boxes.half_y, (boxes.top - boxes.bottom) / 2], axis=1)
    axes = jnp.stack([jnp.stack(a, axis=1) for a in ((cos, sin, zero), (-sin, cos, zero), (zero, zero, one))], axis=1)
    rows = jnp.sum(axes[:, :, :, None] * basis, axis=2)  # [M, axis, (x, y, 1)]: direction along each axis of the box
    low, high = 1 / (centre - half), 1 / (centre + half)  # nearness of the two faces, for a direction of 1
    outside = jnp.abs(centre) > half
    near, far = jnp.where(centre > 0, low, high), jnp.where(centre > 0, high, low)
    # From outside a slab a ray enters by the near face and leaves by the far one; from inside it leaves by one of them.
    # A box that is not in use, or that has a NaN, is entered at minus infinity: never.
    usable = (boxes.used & jnp.isfinite(jnp.sum(centre, 1) + jnp.sum(half, 1) + jnp.sum(rows, (1, 2))))[:, None]
    rows = jnp.where(usable[..., None], rows, 0.0)
    enter_gain = jnp.where(usable & outside, near, 0.0)
    enter_base = jnp.where(usable, jnp.where(outside, 0.0, INSIDE), -jnp.inf)
    leave_gain = (
        jnp.where(usable, jnp.where(outside, far, low), 0.0),
        jnp.where(usable, jnp.where(outside, far, high), 0.0),
    )

    def cast_box(found, box):
        rows, enter_gain, enter_base, (leave_low, leave_high), mark = box
        enter, leave = jnp.full_like(x, jnp.inf), jnp.zeros_like(x)
        for axis in range(3):
            along = rows[axis, 0] * x + (rows[axis, 1] * y + rows[axis, 2])
            enter = least(enter, along * enter_gain[axis] + enter_base[axis])
            leave = greatest(leave, greatest(along * leave_low[axis], along * leave_high[axis]))
        return jnp.maximum(found, key(jnp.where(enter >= leave, enter, 0.0), mark)), None

    # A loop keeps its state in memory: unrolled, XLA would repeat the casting for each of the many uses of the result.
    return jax.lax.scan(cast_box, background, (rows, enter_gain, enter_base, leave_gain, marks))[0]


def least(a: Rays, b: Rays) -> Rays:
    """Minimum as one machine instruction: `jnp.minimum` also propagates NaN, which takes three."""
    return jnp.where(b < a, b, a)


def greatest(a: Rays, b: Rays) -> Rays:
    """Maximum as one machine instruction."""
    return jnp.where(b > a, b, a)


def cast_floor(
    size_xy: Float[Array, "2"], origin: Float[Array, "3"], basis: Float[Array, "3 3"], x: Rays, y: Rays
) -> Float[Array, "R"]:
    """Nearness of the floor, the rectangle [0, size] at z = 0; 0 where a ray misses it, or for NaN."""
    direction = [basis[i, 0] * x + (basis[i, 1] * y + basis[i, 2]) for i in range(3)]
    nearness = direction[2] * (-1 / origin[2])
    on_floor = (origin[2] > 0) & (nearness > 0)
    for i in range(2):
        on_floor = on_floor & (direction[i] >= -origin[i] * nearness)
        on_floor = on_floor & (direction[i] <= (size_xy[i] - origin[i]) * nearness)
    return jnp.where(on_floor, nearness, 0.0)


def key(nearness: Float[Array, "*R"], mark: Bool[Array, ""]) -> Int32[Array, "*R"]:
    """Nearness and a mark in one number, so that a single maximum finds the nearest hit and its mark.

    Bits of a non-negative float32 order like the float. The mark takes the lowest bit: a relative error of 1e-7.
    """
    bits = jax.lax.bitcast_convert_type(nearness.astype(jnp.float32), jnp.int32)
    return (bits & ~1) | mark.astype(jnp.int32)


def nearness(keys: Int32[Array, "*R"]) -> Float[Array, "*R"]:
    """The nearness in `keys`."""
    return jax.lax.bitcast_convert_type(keys & ~1, jnp.float32)


def marked(keys: Int32[Array, "*R"]) -> Bool[Array, "*R"]:
    """The mark in `keys`; meaningless where the nearness is 0."""
    return (keys & 1) > 0
