"""Where the robot believes it stands: an extended Kalman filter over (x, y, yaw), shared by all sensors.

Odometry predicts, landmarks of known place correct (paper, 2.1). Each landmark seen is one observation of two numbers,
so that a single one, which fixes no pose by itself, still counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxbiped.arenas.arena import Landmarks
from jaxbiped.geometry.pose import Pose, to_robot, to_world, wrap_angle
from jaxbiped.geometry.small import matrix, product
from jaxbiped.sensing.view import Sightings

GATE = 18.4  # squared Mahalanobis distance with two degrees of freedom: one good sighting in 10,000 is refused
LEAST_VARIANCE = 1e-8  # [m^2] of a sighting: keeps the innovation invertible in float32


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Belief:
    """Believed pose and its uncertainty. The height of the pose is carried along, not estimated."""

    pose: Pose
    cov: Float[Array, "*B 3 3"]  # of (x, y, yaw) [m, m, rad], world frame


def known(pose: Pose) -> Belief:
    """The belief of a robot that knows its pose."""
    return Belief(pose, jnp.zeros((3, 3)))


def predict(
    belief: Belief,
    dx: Float[Array, ""],
    dy: Float[Array, ""],
    dyaw: Float[Array, ""],
    variances: Float[Array, "3"],
) -> Belief:
    """The belief after a displacement (dx, dy, dyaw) in the robot frame before it, as odometry tells it.

    `variances` [m^2, m^2, rad^2] are those of the displacement's own error, in that frame.
    """
    pose = belief.pose
    x, y = to_world(pose, dx, dy)
    cos, sin, zero, one = jnp.cos(pose.yaw), jnp.sin(pose.yaw), jnp.zeros_like(pose.yaw), jnp.ones_like(pose.yaw)
    F = matrix(((one, zero, pose.y - y), (zero, one, x - pose.x), (zero, zero, one)))
    G = matrix(((cos, -sin, zero), (sin, cos, zero), (zero, zero, one)))
    cov = product(product(F, belief.cov), F.T) + product(G * variances, G.T)
    return Belief(Pose(x, y, pose.z, wrap_angle(pose.yaw + dyaw)), cov)


def correct(belief: Belief, landmarks: Landmarks, sightings: Sightings) -> Belief:
    """The belief after the landmarks seen, one after the other, each linearised about what those before it gave.

    Sightings that disagree with the belief by more than `GATE` are refused. Unseen slots, and sightings that are not
    finite, change nothing.
    """

    def fuse(belief: Belief, slot) -> tuple[Belief, None]:
        landmark_x, landmark_y, used, seen_x, seen_y, sd, seen = slot
        pose, P = belief.pose, belief.cov
        expected_x, expected_y = to_robot(pose, landmark_x, landmark_y)
        cos, sin = jnp.cos(pose.yaw), jnp.sin(pose.yaw)
        H = matrix(((-cos, -sin, expected_y), (sin, -cos, -expected_x)))
        R = jnp.maximum(sd * sd, LEAST_VARIANCE) * jnp.eye(2)
        PHt = product(P, H.T)
        S = product(H, PHt) + R
        determinant = S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0]
        S_inverse = matrix(((S[1, 1], -S[0, 1]), (-S[1, 0], S[0, 0]))) / determinant
        innovation = jnp.stack([seen_x - expected_x, seen_y - expected_y])
        distance = jnp.sum(innovation * jnp.sum(S_inverse * innovation, axis=1))
        K = product(PHt, S_inverse)
        step = jnp.sum(K * innovation, axis=1)
        rest = jnp.eye(3) - product(K, H)
        cov = product(product(rest, P), rest.T) + product(product(K, R), K.T)  # Joseph's form stays positive
        good = used & seen & (distance <= GATE) & jnp.all(jnp.isfinite(cov))
        x, y, yaw = pose.x + step[0], pose.y + step[1], wrap_angle(pose.yaw + step[2])
        pose = Pose(
            x=jnp.where(good, x, pose.x), y=jnp.where(good, y, pose.y), z=pose.z, yaw=jnp.where(good, yaw, pose.yaw)
        )
        return Belief(pose, jnp.where(good, cov, P)), None

    slots = (landmarks.x, landmarks.y, landmarks.used, sightings.x, sightings.y, sightings.sd, sightings.seen)
    return jax.lax.scan(fuse, belief, slots)[0]
