"""The robot's believed pose: an iterated extended Kalman filter over (x, y, yaw), shared by all sensors.

Odometry predicts, landmarks of known position correct (paper, 2.1). Each landmark seen is one observation of two
numbers, so a single one, which does not determine a pose, still counts. Without landmarks (which the paper names as
future work) two pictures give the motion between them, and a map gives the pose itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxbiped.arenas.arena import Landmarks
from jaxbiped.core.checks import finite
from jaxbiped.core.signatures import checked
from jaxbiped.geometry.pose import Pose, to_robot, to_world, wrap_angle
from jaxbiped.geometry.small import matrix, product
from jaxbiped.sensing.view import Motion, Sightings

GATE = 18.4  # squared Mahalanobis distance with two degrees of freedom: one good sighting in 10,000 is rejected
GATE_POSE = 21.1  # the same with three degrees of freedom
ROUNDS = 3  # rounds of linearisation
LEAST_VARIANCE = 1e-8  # [m^2, rad^2] of measurements: keeps the innovation invertible in float32


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Belief:
    """Believed pose and its uncertainty. The height of the pose is carried along, not estimated."""

    pose: Pose
    cov: Float[Array, "*B 3 3"]  # of (x, y, yaw) [m, m, rad], world frame


@checked()
def known(pose: Pose) -> Belief:
    """The belief of a robot that knows its pose."""
    return Belief(pose, jnp.zeros((3, 3)))


@checked(numbers=("dx", "dy", "dyaw", "variances"))
def predict(
    belief: Belief,
    dx: Float[Array, ""],
    dy: Float[Array, ""],
    dyaw: Float[Array, ""],
    variances: Float[Array, "3"],
) -> Belief:
    """The belief after a displacement (dx, dy, dyaw) in the robot frame before it, according to odometry.

    `variances` [m^2, m^2, rad^2] are those of the displacement's error, in that frame.

    Raises:
      InputError: an argument of another rank, shape or type, a displacement that is not finite, or variances that are
        not 0 or more. (Under `jit` NaN stays in such a belief.)
    """
    for name, value in (("dx", dx), ("dy", dy), ("dyaw", dyaw)):
        finite(name, value)
    finite("variances", variances, 0.0)
    after, F, G = displaced(belief.pose, dx, dy, dyaw)
    return Belief(after, product(product(F, belief.cov), F.T) + product(G * variances, G.T))


def displaced(
    pose: Pose, dx: Float[Array, ""], dy: Float[Array, ""], dyaw: Float[Array, ""]
) -> tuple[Pose, Float[Array, "3 3"], Float[Array, "3 3"]]:
    """A pose after a displacement in its own frame, and the Jacobians of the errors of pose and displacement."""
    x, y = to_world(pose, dx, dy)
    cos, sin, zero, one = jnp.cos(pose.yaw), jnp.sin(pose.yaw), jnp.zeros_like(pose.yaw), jnp.ones_like(pose.yaw)
    F = matrix(((one, zero, pose.y - y), (zero, one, x - pose.x), (zero, zero, one)))
    G = matrix(((cos, -sin, zero), (sin, cos, zero), (zero, zero, one)))
    return Pose(x, y, pose.z, wrap_angle(pose.yaw + dyaw)), F, G


@checked(numbers=("moved", "variances"))
def predict_seen(
    belief: Belief, moved: Float[Array, "3"], variances: Float[Array, "3"], motion: Motion
) -> tuple[Belief, Bool[Array, ""]]:
    """As `predict`, if two pictures measured the same displacement too; also whether that was accepted.

    These are two measurements of one displacement with independent errors: the result is their mean, weighted by
    covariance. A motion that disagrees with odometry by more than `GATE_POSE`, was not seen, or is not finite, changes
    nothing.
    """
    told = jnp.stack([motion.x, motion.y, motion.yaw])
    apart = wrap_last(told - moved)
    Q = jnp.diag(variances)
    R = motion.cov + LEAST_VARIANCE * jnp.eye(3)
    gain, distance = weigh(Q, R, apart)
    good = motion.seen & (distance <= GATE_POSE) & jnp.all(jnp.isfinite(gain)) & jnp.all(jnp.isfinite(told))
    both = moved + jnp.sum(gain * apart, axis=1)
    rest = jnp.eye(3) - gain
    cov = product(product(rest, Q), rest.T) + product(product(gain, R), gain.T)
    moved, cov = jnp.where(good, both, moved), jnp.where(good, cov, Q)
    after, F, G = displaced(belief.pose, *moved)
    return Belief(after, product(product(F, belief.cov), F.T) + product(product(G, cov), G.T)), good


def weigh(
    P: Float[Array, "3 3"], R: Float[Array, "3 3"], apart: Float[Array, "3"]
) -> tuple[Float[Array, "3 3"], Float[Array, ""]]:
    """The gain P (P + R)^-1 of a measurement with covariance R, and the squared Mahalanobis distance of `apart`."""
    S_inverse = inverse(P + R)
    return product(P, S_inverse), jnp.sum(apart * jnp.sum(S_inverse * apart, axis=1))


def inverse(S: Float[Array, "3 3"]) -> Float[Array, "3 3"]:
    """Inverse of a symmetric positive matrix whose rows may differ in unit: scaled to a unit diagonal, then by
    cofactors."""
    scale = 1 / jnp.sqrt(jnp.maximum(jnp.diagonal(S), 1e-30))
    a, b, c, d, e, f = (S * scale[:, None] * scale)[np.triu_indices(3)]
    rows = ((d * f - e * e, c * e - b * f, b * e - c * d), (c * e - b * f, a * f - c * c, b * c - a * e),
            (b * e - c * d, b * c - a * e, a * d - b * b))  # fmt: skip
    cofactors = matrix(rows)
    determinant = a * cofactors[0, 0] + b * cofactors[0, 1] + c * cofactors[0, 2]
    return cofactors / determinant * scale[:, None] * scale


def wrap_last(difference: Float[Array, "3"]) -> Float[Array, "3"]:
    """A difference of two (x, y, yaw), with its angle wrapped to (-pi, pi]."""
    return difference.at[2].set(wrap_angle(difference[2]))


@checked()
def correct(belief: Belief, landmarks: Landmarks, sightings: Sightings) -> Belief:
    """The belief after the landmarks seen, fused one after another.

    Iterated: a sighting is linearised about the believed pose first, and then again about the resulting pose, since
    after a long path without landmarks a heading may have an error of some degrees. Sightings that disagree with the
    belief by more than `GATE` are rejected. Unseen slots, and sightings that are not finite, change nothing.
    """
    numbers = (landmarks.x, landmarks.y, sightings.x, sightings.y, sightings.sd)
    seen = landmarks.used & sightings.seen & jnp.isfinite(sum(numbers))
    # Meaningless numbers are 0: NaN would stay in every derivative even if not selected.
    x, y, seen_x, seen_y, sd = (jnp.where(seen, values, 0.0) for values in numbers)
    slots = (x, y, landmarks.used, seen_x, seen_y, sd, seen)

    def once(about: Belief, _) -> tuple[Belief, None]:
        return jax.lax.scan(lambda state, slot: (fuse(state, about.pose, *slot), None), belief, slots)[0], None

    return jax.lax.scan(once, belief, length=ROUNDS)[0]


def fuse(
    belief: Belief,
    about: Pose,
    landmark_x: Float[Array, ""],
    landmark_y: Float[Array, ""],
    used: Bool[Array, ""],
    seen_x: Float[Array, ""],
    seen_y: Float[Array, ""],
    sd: Float[Array, ""],
    seen: Bool[Array, ""],
) -> Belief:
    """The belief after one sighting of one landmark, linearised about a pose."""
    pose, P = belief.pose, belief.cov
    x, y = to_robot(about, landmark_x, landmark_y)
    cos, sin = jnp.cos(about.yaw), jnp.sin(about.yaw)
    H = matrix(((-cos, -sin, y), (sin, -cos, -x)))
    off = jnp.stack([pose.x - about.x, pose.y - about.y, wrap_angle(pose.yaw - about.yaw)])
    innovation = jnp.stack([seen_x - x, seen_y - y]) - jnp.sum(H * off, axis=1)
    R = jnp.maximum(sd * sd, LEAST_VARIANCE) * jnp.eye(2)
    PHt = product(P, H.T)
    S = product(H, PHt) + R
    determinant = S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0]
    S_inverse = matrix(((S[1, 1], -S[0, 1]), (-S[1, 0], S[0, 0]))) / determinant
    distance = jnp.sum(innovation * jnp.sum(S_inverse * innovation, axis=1))
    K = product(PHt, S_inverse)
    step = jnp.sum(K * innovation, axis=1)
    rest = jnp.eye(3) - product(K, H)
    cov = product(product(rest, P), rest.T) + product(product(K, R), K.T)  # Joseph's form stays positive
    good = used & seen & (distance <= GATE) & jnp.all(jnp.isfinite(cov))
    moved = Pose(pose.x + step[0], pose.y + step[1], pose.z, wrap_angle(pose.yaw + step[2]))
    return jax.tree.map(lambda new, old: jnp.where(good, new, old), Belief(moved, cov), belief)
