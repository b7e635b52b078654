"""Floor-plane refit: one view brought level by the floor and the bumps that it sees.

Attitude, not stereo noise, breaks bumps of 3 cm: half a degree of pitch moves the floor by 9 mm at 1 m.
"""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxbiped.core.signatures import checked
from jaxbiped.mapping.grid import GridSpec
from jaxbiped.mapping.params import MapParams
from jaxbiped.sensing.view import View

# Rounds of the fit: points up to this range [m], and residuals up to this multiple of `refit_inlier`. Near points come
# first: one degree of tilt is more than half a level at 1 m, and only 5 mm at 0.3 m. Each round is wide enough for what
# tilt the one before has left.
ROUNDS = ((0.3, 1.2), (0.3, 1.0), (0.45, 1.0), (0.75, 1.0), (0.9, 1.0), (1.2, 1.0))
# What is known before the fit, as one observation of PRIOR_PIXELS pixels (a matcher's pixels are correlated): the plane
# passes within 1 cm under the robot, sloped by less than 1.5 degrees, and a pixel is good to 4 mm.
PRIOR_PIXELS, PRIOR_OFFSET, PRIOR_SLOPE, PIXEL_SD = 50.0, 0.01, 0.026, 0.004
# Ground need not lie at a level: what is nearest to one level, or to the middle between two, lies off it by about
# OFF_LEVEL, and is told from an error of the plane because the robot knows how high it stands, to OWN_HEIGHT. What
# comes out as less than PLAIN is noise.
OFF_LEVEL, OWN_HEIGHT, PLAIN = 0.010, 0.003, 0.0015  # [m]
SAMPLE = 1000  # points that the fit is made of, at least where a view has as many

Scalar = Float[Array, ""]


@checked(numbers=("params",))
def level_view(view: View, support: Scalar | float, params: MapParams, spec: GridSpec) -> View:
    """One view brought level by the floor that it sees: turned about the robot's foot, so that the floor lies flat.

    Fits z = a + b x + c y, in the robot's frame, to points that may lie at any height that a robot may stand on, seen
    from `support` [m], the height of what the robot stands on. Each round gives every point to the nearest half level,
    finds how far the ground there lies off that (a bump of 4 cm must neither lift nor tilt the floor), and solves one
    reweighted least squares (Tukey's biweight, pixel weights, a weak prior). About a thousand points take
    part, every n-th of the view. The refit is refused, and the view returned as it was, when the plane's slope or
    height reaches `params.refit_slope` or `params.refit_offset`, or fewer than `params.refit_points` pixels lie on it.

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


def fit_floor(view: View, support: Scalar, params: MapParams, spec: GridSpec) -> tuple[Scalar, Scalar, Scalar]:
    """The plane (a [m], b, c) of `level_view`; zeros where it is refused."""
    stride = max(1, view.x.shape[-1] // SAMPLE) | 1  # odd, so that it does not run down a column of an image
    x, y, z, pixels = (v[::stride] for v in (view.x, view.y, view.z, view.weight))
    known = jnp.isfinite(x) & jnp.isfinite(y) & jnp.isfinite(z) & (pixels > 0) & (pixels < jnp.inf)
    x, y, z = (jnp.where(known, v, 0.0) for v in (x, y, z))
    pixels = jnp.where(known, pixels * stride, 0.0)
    range_squared = x * x + y * y
    rise, count = spec.level_height / 2, 2 * spec.ground_levels - 1

    def weigh(plane, lifts, reach, width):
        """Half level that each point is nearest to, its height [m] over the ground there, and its weight."""
        above = z - (plane[0] + plane[1] * x + plane[2] * y)
        level = jnp.clip(jnp.round((above + support) / rise), 0, count - 1)
        lift = sum(jnp.where(level == k, lifts[k], 0.0) for k in range(count))
        residual = above - (level * rise - support) - lift
        near = jnp.where(range_squared < reach**2, pixels, 0.0)
        return level, residual, near * jnp.maximum(1 - (residual / (width * params.refit_inlier)) ** 2, 0.0) ** 2

    def solve(level, weight):
        height = z - (level * rise - support)
        parts = [jnp.where(level == k, weight, 0.0) for k in range(count)]
        first = tuple(jnp.array([jnp.sum(part * factor) for part in parts]) for factor in (1.0, x, y, height))
        second = tuple(jnp.sum(weight * product) for product in (x * x, x * y, y * y))
        return solve_ground(first, second, tuple(jnp.sum(weight * height * other) for other in (x, y)))

    plane, lifts = (jnp.float32(0),) * 3, (jnp.float32(0),) * count
    reaches, widths = (jnp.array(column) for column in zip(*ROUNDS, strict=True))

    def refine(k, state):
        level, _, weight, _ = state
        plane, lifts = solve(level, weight)
        after = jnp.minimum(k + 1, len(ROUNDS) - 1)
        return *weigh(plane, lifts, reaches[after], widths[after]), plane

    # A loop, so that weights are worked out once a round: unrolled, the compiler does so anew for each sum of them.
    state = *weigh(plane, lifts, reaches[0], widths[0]), plane
    _, residual, _, plane = jax.lax.fori_loop(0, len(ROUNDS), refine, state)
    on_floor = (jnp.abs(residual) < params.refit_inlier) & (range_squared < ROUNDS[-1][0] ** 2)
    accept = (
        (jnp.hypot(plane[1], plane[2]) < params.refit_slope)
        & (jnp.abs(plane[0]) < params.refit_offset)
        & (jnp.sum(jnp.where(on_floor, pixels, 0.0)) >= params.refit_points)
    )
    return tuple(jnp.where(accept, number, 0.0) for number in plane)


def solve_ground(
    first: tuple[Float[Array, "K"], ...], second: tuple[Scalar, Scalar, Scalar], right: tuple[Scalar, Scalar]
) -> tuple[tuple[Scalar, Scalar, Scalar], tuple[Scalar, ...]]:
    """(a, b, c) of z = a + b x + c y + lift, and the lift [m] of each half level's ground: least squares with priors.

    The lifts are eliminated, solved for, and, where they are no more than noise, taken for none; the plane is then that
    of what is left.

    Args:
      first: of the weights of each half level's points, times 1, x, y and z; z over the half level.
      second: of all weights, times xx, xy and yy; `right` times xz and yz.
    """
    n, nx, ny, nz = first
    share = 1 / (n + PRIOR_PIXELS * (PIXEL_SD / OFF_LEVEL) ** 2)
    total = n.sum(), nx.sum(), ny.sum()
    right = nz.sum(), *right
    a, b, c = solve_plane(
        tuple(t - (n * part * share).sum() for t, part in zip(total, (n, nx, ny), strict=True)),
        (
            second[0] - (nx * nx * share).sum(),
            second[1] - (nx * ny * share).sum(),
            second[2] - (ny * ny * share).sum(),
        ),
        tuple(t - (nz * part * share).sum() for t, part in zip(right, (n, nx, ny), strict=True)),
        OWN_HEIGHT,
    )
    lifts = (nz - a * n - b * nx - c * ny) * share
    lifts = jnp.where(jnp.abs(lifts) > PLAIN, lifts, 0.0)
    left = tuple(t - (lifts * part).sum() for t, part in zip(right, (n, nx, ny), strict=True))
    return solve_plane(total, second, left, PRIOR_OFFSET), tuple(lifts)


def solve_plane(
    first: tuple[Scalar, Scalar, Scalar],
    second: tuple[Scalar, Scalar, Scalar],
    right: tuple[Scalar, Scalar, Scalar],
    offset: float,
) -> tuple[Scalar, Scalar, Scalar]:
    """(a, b, c) of z = a + b x + c y from weighted sums, with the prior that a is within `offset` [m], in closed form.

    Plain sums and Cramer's rule: small matrix products and a library's solve would be called once for each arena.

    Args:
      first: of 1, x, y; `second` of xx, xy, yy; `right` of z, xz, yz.
    """
    (n, nx, ny), (xx, xy, yy), (zn, zx, zy) = first, second, right
    slope = PRIOR_PIXELS * (PIXEL_SD / PRIOR_SLOPE) ** 2
    n, xx, yy = n + PRIOR_PIXELS * (PIXEL_SD / offset) ** 2, xx + slope, yy + slope
    # Cofactors of the symmetric 3 x 3 matrix [[n, nx, ny], [nx, xx, xy], [ny, xy, yy]].
    nn_, nx_, ny_ = xx * yy - xy * xy, ny * xy - nx * yy, nx * xy - ny * xx
    xx_, xy_, yy_ = n * yy - ny * ny, nx * ny - n * xy, n * xx - nx * nx
    determinant = n * nn_ + nx * nx_ + ny * ny_
    a = nn_ * zn + nx_ * zx + ny_ * zy
    b = nx_ * zn + xx_ * zx + xy_ * zy
    c = ny_ * zn + xy_ * zx + yy_ * zy
    return a / determinant, b / determinant, c / determinant
