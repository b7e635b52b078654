"""Floor-plane refit: one view brought level by the floor and the bumps that it sees.

Attitude, not stereo noise, breaks bumps of 3 cm: half a degree of pitch moves the floor by 9 mm at 1 m.
"""

from __future__ import annotations

from dataclasses import replace

import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from jaxbiped.mapping.grid import GridSpec
from jaxbiped.mapping.params import MapParams
from jaxbiped.sensing.view import View

# Rounds of the fit: points up to this range [m], and residuals up to this multiple of `refit_inlier`. Near points come
# first: one degree of tilt is more than half a level at 1 m, and only 5 mm at 0.3 m.
ROUNDS = ((0.45, 1.9), (0.45, 1.6), (0.7, 1.6), (0.9, 1.4), (1.2, 1.2), (1.2, 1.0))
# What is known before the fit, as one observation of PRIOR_PIXELS pixels (a matcher's pixels are correlated): the plane
# passes within 1 cm under the robot, sloped by less than 1.5 degrees, and a pixel is good to 4 mm.
PRIOR_PIXELS, PRIOR_OFFSET, PRIOR_SLOPE, PIXEL_SD = 50.0, 0.01, 0.026, 0.004


def level_view(view: View, support: Int[Array, ""] | int, params: MapParams, spec: GridSpec) -> View:
    """One view with its floor brought level; heights change, plan positions do not.

    Fits z = a + b x + c y, in the robot's frame, to points that may lie on any level that a robot may stand on, seen
    from one of level `support` (so that the base floor may lie at -3 or -6 cm): each round snaps residuals to the
    nearest of these levels and solves one reweighted least squares (Tukey's biweight, pixel weights, a weak prior).
    The refit is refused, and the view returned as it was, when the plane's slope or height is beyond
    `params.refit_slope` or `params.refit_offset`, or fewer than `params.refit_points` pixels lie on it.

    Points with weight 0, and points that are not finite, take no part. Deviation: the paper does not refit.
    """
    known = jnp.isfinite(view.x) & jnp.isfinite(view.y) & jnp.isfinite(view.z) & (view.weight > 0)
    known &= jnp.isfinite(view.weight)
    x, y, z = (jnp.where(known, v, 0.0) for v in (view.x, view.y, view.z))
    pixels = jnp.where(known, view.weight, 0.0)
    range_squared = x * x + y * y
    support = jnp.asarray(support, jnp.float32)

    def off_level(plane: Float[Array, "3"]) -> tuple[Float[Array, "N"], Float[Array, "N"]]:
        """Height [m] of each point over the nearest level that can be ground, and that level's height."""
        above = z - (plane[0] + plane[1] * x + plane[2] * y)
        level = jnp.clip(jnp.round(above / spec.level_height), -support, spec.ground_levels - 1 - support)
        return above - level * spec.level_height, level * spec.level_height

    prior = PRIOR_PIXELS * jnp.array([PIXEL_SD / PRIOR_OFFSET, PIXEL_SD / PRIOR_SLOPE, PIXEL_SD / PRIOR_SLOPE]) ** 2
    plane = jnp.zeros(3)
    for reach, width in ROUNDS:
        residual, level = off_level(plane)
        near = jnp.where(range_squared < reach**2, pixels, 0.0)
        weight = near * jnp.maximum(1 - (residual / (width * params.refit_inlier)) ** 2, 0.0) ** 2
        plane = solve_plane(x, y, z - level, weight, prior)

    residual, _ = off_level(plane)
    on_floor = (jnp.abs(residual) < params.refit_inlier) & (range_squared < ROUNDS[-1][0] ** 2)
    accept = (
        (jnp.hypot(plane[1], plane[2]) < params.refit_slope)
        & (jnp.abs(plane[0]) < params.refit_offset)
        & (jnp.sum(jnp.where(on_floor, pixels, 0.0)) >= params.refit_points)
    )
    plane = jnp.where(accept, plane, 0.0)
    return replace(view, z=view.z - (plane[0] + plane[1] * view.x + plane[2] * view.y))


def solve_plane(
    x: Float[Array, "N"],
    y: Float[Array, "N"],
    z: Float[Array, "N"],
    weight: Float[Array, "N"],
    prior: Float[Array, "3"],
) -> Float[Array, "3"]:
    """(a, b, c) of z = a + b x + c y by weighted least squares with a diagonal prior at zero, in closed form."""
    features = jnp.stack([jnp.ones_like(x), x, y])
    targets = jnp.concatenate([features, z[None]])
    moments = (features * weight) @ targets.T
    a, b, c = moments[:, :3] + jnp.diag(prior)
    right = moments[:, 3]
    # Cramer's rule by cross products: a library solve would be called once for each arena of a batch.
    ab, bc, ca = jnp.cross(a, b), jnp.cross(b, c), jnp.cross(c, a)
    return (bc * right[0] + ca * right[1] + ab * right[2]) / jnp.dot(a, bc)
