"""The edge of a bump as a line, measured from the points of a view to within millimetres (paper, 2.4).

The grid locates an edge to half a cell; a foot must meet it within a few millimetres. So the line between the points of
the ground that the robot stands on and those one level higher or lower is fitted, and kept in the robot's frame: its
distance ahead matters, not the robot's believed position in the world.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.geometry.pose import wrap_angle
from jaxbiped.geometry.small import matrix, product
from jaxbiped.sensing.camera import Mount
from jaxbiped.sensing.view import View

REACH = 0.06  # [m] points up to this far from the line, on both sides, are used: the next edge is farther
HALF_WIDTH = 0.09  # [m] half the width of the measured piece of the edge: that in front of the two feet
# [m] width of the fitted transition, round by round: it finds an edge from 3 cm away, and ends at about the
# distance between two rays on the ground, so that the line lies in the middle of the gap between the two sorts
WIDTHS = (0.015, 0.015, 0.010, 0.010, 0.007, 0.005, 0.004, 0.004)
SOFT = 0.25  # share of the rise, at both ends, within which a height counts as plain ground
STRAY = 0.4  # share of the rise beyond it, within which a height still counts
TRIMMED_FROM = 4  # round from which rays clearly on the wrong side, as beside a corner, do not count
LEAST = 8.0  # rays required on each side of the line
MOST_WRONG = 0.15  # share of the rays that may lie on the wrong side
CLEAR = 0.010  # [m] distance from the line beyond which a ray on the wrong side counts as wrong
# The error of a single view: rays are about 11 mm apart on the ground, and a row of them along the edge
# only shows that the edge lies between this row and the next.
FLOOR_DISTANCE, FLOOR_ANGLE = 0.003, 0.02  # [m, rad] standard deviations
PRIOR_DISTANCE, PRIOR_ANGLE = 0.03, 0.2  # [m, rad] of a line read from the grid
GATE = 16.0  # squared Mahalanobis distance beyond which two lines are not the same


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Edge:
    """A line on the ground where it rises or falls by a level, in the robot frame of the moment."""

    distance: Float[Array, "*B"]  # [m] from the robot's axis, along the normal; negative: behind
    angle: Float[Array, "*B"]  # [rad] of the normal, which points across the edge, relative to forward
    cov: Float[Array, "*B 2 2"]  # of both [m, rad]
    rise: Int[Array, "*B"]  # levels by which the ground beyond is higher: -1 or 1
    known: Bool[Array, "*B"]


def unknown() -> Edge:
    """No edge."""
    zero = jnp.zeros(())
    return Edge(zero, zero, prior_cov(), jnp.zeros((), jnp.int32), jnp.zeros((), bool))


def prior_cov() -> Float[Array, "2 2"]:
    """Uncertainty of a line read from the grid."""
    return jnp.diag(jnp.array([PRIOR_DISTANCE**2, PRIOR_ANGLE**2], jnp.float32))


def predict(edge: Edge, moved: Float[Array, "3"], variances: Float[Array, "3"]) -> Edge:
    """The edge after the robot has moved by (dx, dy, dyaw) [m, m, rad] in the frame before, with these variances."""
    dx, dy, dyaw = moved
    cos, sin, one, zero = jnp.cos(edge.angle), jnp.sin(edge.angle), jnp.ones(()), jnp.zeros(())
    F = matrix(((one, dx * sin - dy * cos), (zero, one)))
    noise = jnp.diag(jnp.stack([variances[0] * cos * cos + variances[1] * sin * sin, variances[2]]))
    return replace(
        edge,
        distance=edge.distance - dx * cos - dy * sin,
        angle=wrap_angle(edge.angle - dyaw),
        cov=product(product(F, edge.cov), F.T) + noise,
    )


def fuse(old: Edge, new: Edge) -> Edge:
    """Fuse two measurements of an edge. If they disagree, the newer; if only one is known, that one."""
    off = jnp.stack([new.distance - old.distance, wrap_angle(new.angle - old.angle)])
    S_inverse = inverse(old.cov + new.cov)
    same = jnp.sum(off * jnp.sum(S_inverse * off, axis=1)) <= GATE
    K = product(old.cov, S_inverse)
    step = jnp.sum(K * off, axis=1)
    both = Edge(
        old.distance + step[0],
        wrap_angle(old.angle + step[1]),
        product(jnp.eye(2) - K, old.cov),
        new.rise,
        old.known,
    )
    merged = old.known & new.known & same & (old.rise == new.rise)
    one = jax.tree.map(lambda n, o: jnp.where(new.known, n, o), new, old)
    return jax.tree.map(lambda b, o: jnp.where(merged, b, o), both, one)


def measure(
    view: View, about: Edge, aside: Float[Array, ""] | float, eye: Mount, level_height: Float[Array, ""] | float
) -> Edge:
    """The edge near a line `about`, from the points of one levelled view (`mapping.level_view`).

    A logistic regression with a fixed, shrinking width: it finds the line that best separates points of the robot's own
    level from those `about.rise` levels higher. Heights in between, as of a bump's face seen from below, attract the
    line. Ground behind a falling edge is hidden; its points count where their ray passed the upper level, so that the
    first of them bounds the edge as closely as the last before it. The paper says that the direction of the edge is
    measured (2.4), but not how.

    Args:
      about: where to search; its `known` and `cov` are not read.
      aside: [m] lateral position, to the left of the robot along the edge, of the middle of the measured piece.
      eye: pose of the camera.
      level_height: [m].

    Returns:
      The edge, with the uncertainty of this view alone; not known if too few points lie on either side, or too many on
      the wrong one.
    """
    height = about.rise * level_height
    toward_eye = jnp.where((about.rise < 0) & (view.z < 0), view.z / (view.z - eye.height), 0.0)
    x = view.x + (eye.forward - view.x) * toward_eye
    y = view.y - view.y * toward_eye
    share = view.z / height
    label = jnp.clip((share - SOFT) / (1 - 2 * SOFT), 0.0, 1.0)
    counts = (view.weight > 0) & (share > -STRAY) & (share < 1 + STRAY)

    def residuals(distance, angle):
        cos, sin = jnp.cos(angle), jnp.sin(angle)
        off, along = x * cos + y * sin - distance, y * cos - x * sin
        near = counts & (jnp.abs(off) < REACH) & (jnp.abs(along - aside) < HALF_WIDTH)
        return off, along, jnp.where(near, 1.0, 0.0)

    distance, angle = about.distance, about.angle
    prior_d, prior_a = PRIOR_DISTANCE**-2, PRIOR_ANGLE**-2
    for k, width in enumerate(WIDTHS):
        off, along, weight = residuals(distance, angle)
        if k >= TRIMMED_FROM:
            weight = jnp.where((jnp.abs(off) > CLEAR) & (jnp.abs(label - (off > 0)) > 0.5), 0.0, weight)
        beyond = 0.5 + 0.5 * jnp.tanh(off / (2 * width))
        pull = weight * (beyond - label) / width
        stiff = weight * beyond * (1 - beyond) / width**2
        dd, da, aa = jnp.sum(stiff), -jnp.sum(stiff * along), jnp.sum(stiff * along * along)
        hd, ha = dd + prior_d, aa + prior_a
        gd = -jnp.sum(pull) + prior_d * (distance - about.distance)
        ga = jnp.sum(pull * along) + prior_a * wrap_angle(angle - about.angle)
        determinant = hd * ha - da * da
        distance = distance - jnp.clip((ha * gd - da * ga) / determinant, -0.02, 0.02)
        angle = angle - jnp.clip((hd * ga - da * gd) / determinant, -0.15, 0.15)

    off, _, weight = residuals(distance, angle)
    here, there = jnp.sum(weight * (1 - label)), jnp.sum(weight * label)
    wrong = jnp.sum(jnp.where(jnp.abs(off) > CLEAR, weight * jnp.abs(label - (off > 0)), 0.0))
    good = (jnp.minimum(here, there) >= LEAST) & (wrong <= MOST_WRONG * (here + there)) & jnp.isfinite(distance + angle)
    noise = jnp.diag(jnp.array([FLOOR_DISTANCE**2, FLOOR_ANGLE**2], jnp.float32))
    cov = inverse(matrix(((hd, da), (da, ha)))) + noise
    return Edge(
        jnp.where(good, distance, about.distance),
        jnp.where(good, wrap_angle(angle), about.angle),
        jnp.where(good, cov, prior_cov()),
        about.rise,
        good,
    )


def inverse(m: Float[Array, "2 2"]) -> Float[Array, "2 2"]:
    """Inverse of a 2 x 2 matrix."""
    determinant = m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]
    return matrix(((m[1, 1], -m[0, 1]), (-m[1, 0], m[0, 0]))) / determinant
