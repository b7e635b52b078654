"""Floor-plane refit: one view brought level by the floor and the bumps that it sees.

Attitude, not stereo noise, breaks bumps of 3 cm: half a degree of pitch moves the floor by 9 mm at 1 m.
"""

from __future__ import annotations

from dataclasses import replace

import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from jaxbiped.core.signatures import checked
from jaxbiped.mapping.grid import GridSpec
from jaxbiped.mapping.params import MapParams
from jaxbiped.sensing.view import View

# Rounds of the fit: points up to this range [m], and residuals up to this multiple of `refit_inlier`. Near points come
# first: one degree of tilt is more than half a level at 1 m, and only 5 mm at 0.3 m.
ROUNDS = ((0.3, 1.9), (0.45, 1.7), (0.75, 1.4), (1.2, 1.0))
# What is known before the fit, as one observation of PRIOR_PIXELS pixels (a matcher's pixels are correlated): the plane
# passes within 1 cm under the robot, sloped by less than 1.5 degrees, and a pixel is good to 4 mm.
PRIOR_PIXELS, PRIOR_OFFSET, PRIOR_SLOPE, PIXEL_SD = 50.0, 0.01, 0.026, 0.004
SAMPLE = 1000  # points that the fit is made of, at least where a view has as many


@checked(numbers=("params",))
def level_view(view: View, support: Int[Array, ""] | int, params: MapParams, spec: GridSpec) -> View:
    """One view brought level by the floor that it sees: turned about the robot's foot, so that the floor lies flat.

    Fits z = a + b x + c y, in the robot's frame, to points that may lie on any level that a robot may stand on, seen
    from one of level `support` (so that the base floor may lie at -3 or -6 cm): each round snaps residuals to the
    nearest of these levels and solves one reweighted least squares (Tukey's biweight, pixel weights, a weak prior).
    About a thousand points take part, every n-th of the view. The refit is refused, and the view returned as it was,
    when the plane's slope or height reaches `params.refit_slope` or `params.refit_offset`, or fewer than
    `params.refit_points` pixels lie on it.

    Points with weight 0, and points that are not finite, take no part. Deviation: the paper does not refit.

    Raises:
      InputError: an argument of another rank, shape or type, or NaN in `params` (which under `jit` refuses the refit).
    """
    plane = fit_floor(view, jnp.asarray(support, jnp.float32), params, spec)
    offset, slope_x, slope_y = plane
    return replace(
        view,
        x=view.x + slope_x * view.z,
        y=view.y + slope_y * view.z,
        z=view.z - (offset + slope_x * view.x + slope_y * view.y),
    )


def fit_floor(
    view: View, support: Float[Array, ""], params: MapParams, spec: GridSpec
) -> tuple[Float[Array, ""], Float[Array, ""], Float[Array, ""]]:
    """The plane (a [m], b, c) of `level_view`; zeros where it is refused."""
    stride = max(1, view.x.shape[-1] // SAMPLE) | 1  # odd, so that it does not run down a column of an image
    x, y, z, pixels = (v[::stride] for v in (view.x, view.y, view.z, view.weight))
    known = jnp.isfinite(x) & jnp.isfinite(y) & jnp.isfinite(z) & (pixels > 0) & (pixels < jnp.inf)
    x, y, z = (jnp.where(known, v, 0.0) for v in (x, y, z))
    pixels = jnp.where(known, pixels * stride, 0.0)
    range_squared = x * x + y * y

    def off_level(plane):
        """Height [m] of each point over the nearest level that can be ground, and that level's height."""
        above = z - (plane[0] + plane[1] * x + plane[2] * y)
        level = jnp.clip(jnp.round(above / spec.level_height), -support, spec.ground_levels - 1 - support)
        return above - level * spec.level_height, level * spec.level_height

    plane = (jnp.float32(0),) * 3
    for reach, width in ROUNDS:
        residual, level = off_level(plane)
        near = jnp.where(range_squared < reach**2, pixels, 0.0)
        weight = near * jnp.maximum(1 - (residual / (width * params.refit_inlier)) ** 2, 0.0) ** 2
        plane = solve_plane(x, y, z - level, weight)

    residual, _ = off_level(plane)
    on_floor = (jnp.abs(residual) < params.refit_inlier) & (range_squared < ROUNDS[-1][0] ** 2)
    accept = (
        (jnp.hypot(plane[1], plane[2]) < params.refit_slope)
        & (jnp.abs(plane[0]) < params.refit_offset)
        & (jnp.sum(jnp.where(on_floor, pixels, 0.0)) >= params.refit_points)
    )
    return tuple(jnp.where(accept, number, 0.0) for number in plane)


def solve_plane(
    x: Float[Array, "N"], y: Float[Array, "N"], z: Float[Array, "N"], weight: Float[Array, "N"]
) -> tuple[Float[Array, ""], Float[Array, ""], Float[Array, ""]]:
    """(a, b, c) of z = a + b x + c y by weighted least squares with the prior, in closed form.

    Plain sums and Cramer's rule: small matrix products and a library's solve would be called once for each arena.
    """
    wx, wy, wz = weight * x, weight * y, weight * z
    prior = PRIOR_PIXELS * (PIXEL_SD / PRIOR_OFFSET) ** 2, PRIOR_PIXELS * (PIXEL_SD / PRIOR_SLOPE) ** 2
    n, nx, ny = jnp.sum(weight) + prior[0], jnp.sum(wx), jnp.sum(wy)
    xx, xy, yy = jnp.sum(wx * x) + prior[1], jnp.sum(wx * y), jnp.sum(wy * y) + prior[1]
    zn, zx, zy = jnp.sum(wz), jnp.sum(wz * x), jnp.sum(wz * y)
    # Cofactors of the symmetric 3 x 3 matrix [[n, nx, ny], [nx, xx, xy], [ny, xy, yy]].
    nn_, nx_, ny_ = xx * yy - xy * xy, ny * xy - nx * yy, nx * xy - ny * xx
    xx_, xy_, yy_ = n * yy - ny * ny, nx * ny - n * xy, n * xx - nx * nx
    determinant = n * nn_ + nx * nx_ + ny * ny_
    a = nn_ * zn + nx_ * zx + ny_ * zy
    b = nx_ * zn + xx_ * zx + xy_ * zy
    c = ny_ * zn + xy_ * zx + yy_ * zy
    return a / determinant, b / determinant, c / determinant
