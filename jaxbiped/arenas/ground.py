"""The ground of an arena, as the robot stands on it and sees it: the floor, the terrain, and the boxes on both."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxbiped.arenas.arena import Arena
from jaxbiped.errors import InputError
from jaxbiped.geometry import boxes
from jaxbiped.geometry.height_field import HeightField, cast_rays, on_field, surface_height
from jaxbiped.geometry.rays import INSIDE, Rays, cast_floor

WITH_TERRAIN = {"sensor": ("oracle", "raycast"), "executor": ("kinematic", "sampled")}  # which support it
HOLE = -1.0  # [m] assumed ground height of a hole: a robot that steps there falls


def ground_height(arena: Arena, x: Float[Array, "*S"], y: Float[Array, "*S"]) -> Float[Array, "*S"]:
    """Height [m] of the ground at points (x, y) [m] of one arena: the highest of terrain and floor-standing boxes.

    Where there is no terrain, the floor is at 0; in holes of the terrain there is no ground, and the height is `HOLE`.
    """
    if arena.terrain is None:
        return boxes.ground_height(arena.boxes, x, y)
    return boxes.ground_height(arena.boxes, x, y, terrain_height(arena.terrain, x, y))


def terrain_height(terrain: HeightField, x: Float[Array, "*S"], y: Float[Array, "*S"]) -> Float[Array, "*S"]:
    """Height [m] of terrain and floor at points (x, y) [m]: 0 beyond the terrain, `HOLE` in its holes."""
    height = surface_height(terrain, x, y)
    return jnp.where(jnp.isnan(height), jnp.where(on_field(terrain, x, y), HOLE, 0.0), height)


def rises_near(
    terrain: HeightField | None,
    x: Float[Array, ""],
    y: Float[Array, ""],
    radius: Float[Array, ""],
    height: Float[Array, ""],
) -> Bool[Array, ""]:
    """Whether the terrain of one arena is higher than `height` [m] within `radius` [m] of a point.

    It is evaluated at the point and at 96 positions around it, at most a quarter of the radius apart: 2 cm for a body.
    """
    if terrain is None:
        return jnp.zeros((), bool)
    rings = jnp.repeat(jnp.arange(1, 5) / 4, 24)
    angles = jnp.tile(jnp.arange(24) * (2 * jnp.pi / 24), 4)
    aside, ahead = (jnp.append(radius * rings * turn(angles), 0.0) for turn in (jnp.sin, jnp.cos))
    return jnp.any(terrain_height(terrain, x + ahead, y + aside) > height)


def cast_ground(
    arena: Arena, origin: Float[Array, "3"], basis: Float[Array, "3 3"], x: Rays, y: Rays
) -> Float[Array, "R"]:
    """Nearness of floor and terrain of one arena for the rays of a pinhole, as in `geometry.rays`; 0 for neither."""
    floor = cast_floor(arena.size_xy, origin, basis, x, y)
    if arena.terrain is None:
        return floor
    direction = jnp.stack([basis[i, 0] * x + (basis[i, 1] * y + basis[i, 2]) for i in range(3)], axis=-1)
    depth = 1 / jnp.where(floor > 0, floor, 1.0)
    under = on_field(arena.terrain, origin[0] + depth * direction[:, 0], origin[1] + depth * direction[:, 1])
    terrain = cast_rays(arena.terrain, origin, direction)
    terrain = jnp.where(jnp.isfinite(terrain), 1 / jnp.maximum(terrain, 1 / INSIDE), 0.0)
    return jnp.maximum(jnp.where(under, 0.0, floor), terrain)


def refuse_terrain(arena: Arena, who: str) -> None:
    """Reject an arena with terrain on behalf of a component that does not support it.

    Raises:
      InputError: the arena has terrain.
    """
    if arena.terrain is not None:
        raise no_terrain_for(who)


def no_terrain_for(who: str) -> InputError:
    """The error about a component that does not support terrain."""
    known = ", ".join(f"{kind}s {' and '.join(names)}" for kind, names in WITH_TERRAIN.items())
    return InputError(f"does not support terrain, which this arena has; supported by {known}", field=who)
