"""From feet and centre of mass to joint angles, and to the torques that hold them."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxbiped.biped.config import GRAVITY
from jaxbiped.biped.leg import Biped, leg_angles, leg_frames, rot_z

ROUNDS = 5  # iterations of the fixed point: each leaves less than a tenth of the error


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Posture:
    """The robot at one moment, torso upright."""

    q: Float[Array, "12"]  # [rad] joint angles, left leg first
    pelvis: Float[Array, "3"]  # [m] midpoint of the hips
    yaw: Float[Array, ""]  # [rad] of the torso
    links: Float[Array, "7 3"]  # [m] centres of mass: torso, then thigh, shank, foot of the left leg and of the right
    slack: Float[Array, "2"]  # [m] remaining reach of each leg; negative: out of reach
    torque: Float[Array, "12"]  # [Nm] needed by the joints at rest


def sole_frame(foot: Float[Array, "4"], height: Float[Array, ""]) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
    """The point [m] `height` above a sole at (x, y, z, yaw), and the attitude of the sole."""
    return foot[:3] + jnp.array([0.0, 0.0, 1.0]) * height, rot_z(foot[3])


def link_masses(biped: Biped) -> Float[Array, "7"]:
    """Masses [kg] in the order of `Posture.links`."""
    return jnp.concatenate([biped.masses, biped.masses[1:]])


def posture(
    biped: Biped,
    com: Float[Array, "2"],
    hip_height: Float[Array, ""],
    feet: Float[Array, "2 4"],
    load: Float[Array, ""],
    pressure: Float[Array, "2 2"],
) -> Posture:
    """The posture that stands on two given soles with its centre of mass above a point.

    The pelvis follows the centre of mass of all links by fixed-point iteration. The torso is upright and its yaw is
    half way between the feet.

    Args:
      com: (x, y) [m] of the centre of mass; hip_height: z [m] of the hips.
      feet: (x, y, z, yaw) of the left and the right sole.
      load: share of the weight on the left foot; pressure: the (x, y) [m] where each foot carries it.
    """
    masses = link_masses(biped)
    yaw = jnp.mean(feet[:, 3])
    R_pelvis = rot_z(yaw)
    side = jnp.array([1.0, -1.0])

    def place(pelvis_xy):
        pelvis = jnp.concatenate([pelvis_xy, hip_height[None]])
        hips = pelvis + side[:, None] * biped.hip * R_pelvis[:, 1]
        ankles, R_feet = jax.vmap(sole_frame, (0, None))(feet, biped.ankle)
        solve = jax.vmap(leg_angles, (None, None, 0, None, 0, 0))
        q, slack = solve(biped.thigh, biped.shank, hips, R_pelvis, ankles, R_feet)
        origins, frames, axes = jax.vmap(leg_frames, (None, None, 0, None, 0))(
            biped.thigh, biped.shank, hips, R_pelvis, q
        )
        legs = origins + frames[..., 2] * biped.centres[1:, None]
        torso = pelvis + jnp.array([0.0, 0.0, 1.0]) * biped.centres[0]
        return pelvis, q, slack, origins, axes, jnp.concatenate([torso[None], legs.reshape(6, 3)])

    # The torso follows the pelvis fully, thighs by three quarters, shanks by one quarter.
    share = (biped.masses[0] + 1.5 * biped.masses[1] + 0.5 * biped.masses[2]) / jnp.sum(masses)

    def improve(pelvis_xy, _):
        links = place(pelvis_xy)[-1]
        centre = masses @ links[:, :2] / jnp.sum(masses)
        return pelvis_xy + (com - centre) / share, None

    pelvis_xy, _ = jax.lax.scan(improve, com, None, length=ROUNDS)
    pelvis, q, slack, origins, axes, links = place(pelvis_xy)

    weights = GRAVITY * jnp.sum(masses) * jnp.stack([load, 1.0 - load])
    torque = jax.vmap(_holding_torque, (None, 0, 0, 0, 0, 0))(
        biped, origins, axes, links[1:].reshape(2, 3, 3), weights, pressure
    )
    return Posture(q.reshape(12), pelvis, yaw, links, slack, torque.reshape(12))


def _holding_torque(
    biped: Biped,
    origins: Float[Array, "3 3"],
    axes: Float[Array, "6 3"],
    links: Float[Array, "3 3"],
    weight: Float[Array, ""],
    pressure: Float[Array, "2"],
) -> Float[Array, "6"]:
    """Torques [Nm] of one leg at rest: each joint carries the links below it and the vertical force on its foot."""
    below = jnp.array([[1, 1, 1], [1, 1, 1], [1, 1, 1], [0, 1, 1], [0, 0, 1], [0, 0, 1]], jnp.float32)
    origin = origins[jnp.array([0, 0, 0, 1, 2, 2])]
    forces = jnp.concatenate([-GRAVITY * biped.masses[1:] * below, jnp.broadcast_to(weight, (6, 1))], axis=1)
    points = jnp.concatenate([links[:, :2], pressure[None]])
    arms = points[None] - origin[:, None, :2]  # [6, 4, 2]
    moment_xy = jnp.sum(forces[..., None] * jnp.stack([arms[..., 1], -arms[..., 0]], axis=-1), axis=1)
    return -jnp.sum(axes[:, :2] * moment_xy, axis=1)
