"""A leg of six joints: its inverse and its forward kinematics, both exact.

Joints from the hip down: yaw, roll, pitch (axes meet in the hip), knee pitch, ankle pitch, roll (axes meet in the
ankle). With R the rotation of the foot in the pelvis frame, R = Rz(yaw) Rx(roll) Ry(hip + knee + ankle pitch)
Rx(ankle roll). A bent knee is positive.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Biped:
    """`RobotModelConfig`, traced: the parameters of the generator's formulas."""

    thigh: Float[Array, ""]  # [m]
    shank: Float[Array, ""]  # [m]
    ankle: Float[Array, ""]  # [m] above the sole
    hip: Float[Array, ""]  # [m] lateral offset
    masses: Float[Array, "4"]  # [kg] torso, thigh, shank, foot
    centres: Float[Array, "4"]  # [m] their centres of mass, above hips, hip, knee and ankle
    foot: Float[Array, "2"]  # [m] length, width
    servo: Float[Array, "2"]  # kp [Nm/rad]; kv and damping together [Nm s/rad]


def rot_x(a: Float[Array, ""]) -> Float[Array, "3 3"]:
    """Rotation about x by `a` [rad]."""
    c, s, one, nil = jnp.cos(a), jnp.sin(a), jnp.ones_like(a), jnp.zeros_like(a)
    return jnp.stack([one, nil, nil, nil, c, -s, nil, s, c]).reshape(3, 3)


def rot_y(a: Float[Array, ""]) -> Float[Array, "3 3"]:
    """Rotation about y by `a` [rad]."""
    c, s, one, nil = jnp.cos(a), jnp.sin(a), jnp.ones_like(a), jnp.zeros_like(a)
    return jnp.stack([c, nil, s, nil, one, nil, -s, nil, c]).reshape(3, 3)


def rot_z(a: Float[Array, ""]) -> Float[Array, "3 3"]:
    """Rotation about z by `a` [rad]."""
    c, s, one, nil = jnp.cos(a), jnp.sin(a), jnp.ones_like(a), jnp.zeros_like(a)
    return jnp.stack([c, -s, nil, s, c, nil, nil, nil, one]).reshape(3, 3)


def leg_angles(
    thigh: Float[Array, ""],
    shank: Float[Array, ""],
    hip: Float[Array, "3"],
    R_pelvis: Float[Array, "3 3"],
    ankle: Float[Array, "3"],
    R_foot: Float[Array, "3 3"],
) -> tuple[Float[Array, "6"], Float[Array, ""]]:
    """Joint angles [rad] that put the ankle at a position and the foot in an attitude.

    The distance of hip and ankle gives the knee; the direction of the hip, seen from the foot, gives the ankle; the
    remaining rotation gives the hip. Of the solutions, the one with the knee bent forward and |hip roll| < 90 deg.

    Args:
      thigh, shank: lengths [m].
      hip, ankle: points [m] in one frame; R_pelvis, R_foot: attitudes in that frame.

    Returns:
      The angles, and the slack [m]: length of the straight leg minus the distance. If it is negative the ankle is
      out of reach and the angles are those of a straight leg that points at it; callers must check the slack.
    """
    x, y, z = R_foot.T @ (hip - ankle)
    upright = jnp.hypot(y, z)
    distance = jnp.sqrt(x**2 + upright**2)
    cos_knee = (distance**2 - thigh**2 - shank**2) / (2 * thigh * shank)
    knee = jnp.arccos(jnp.clip(cos_knee, -1.0 + 1e-6, 1.0 - 1e-6))
    ankle_roll = jnp.arctan2(y, z)
    ankle_pitch = jnp.arctan2(-x, upright) - jnp.arctan2(thigh * jnp.sin(knee), shank + thigh * jnp.cos(knee))
    R_thigh = R_pelvis.T @ R_foot @ rot_x(-ankle_roll) @ rot_y(-ankle_pitch - knee)
    hip_yaw = jnp.arctan2(-R_thigh[0, 1], R_thigh[1, 1])
    hip_roll = jnp.arctan2(R_thigh[2, 1], jnp.hypot(R_thigh[0, 1], R_thigh[1, 1]))
    hip_pitch = jnp.arctan2(-R_thigh[2, 0], R_thigh[2, 2])
    return jnp.stack([hip_yaw, hip_roll, hip_pitch, knee, ankle_pitch, ankle_roll]), thigh + shank - distance


def leg_frames(
    thigh: Float[Array, ""],
    shank: Float[Array, ""],
    hip: Float[Array, "3"],
    R_pelvis: Float[Array, "3 3"],
    angles: Float[Array, "6"],
) -> tuple[Float[Array, "3 3"], Float[Array, "3 3 3"], Float[Array, "6 3"]]:
    """Forward kinematics: origins [m] of thigh, shank and foot (hip, knee, ankle), their attitudes, the joint axes."""
    yaw, roll, pitch, knee, ankle_pitch, ankle_roll = angles
    R_yaw = R_pelvis @ rot_z(yaw)
    R_roll = R_yaw @ rot_x(roll)
    R_thigh = R_roll @ rot_y(pitch)
    R_shank = R_thigh @ rot_y(knee)
    R_pitch = R_shank @ rot_y(ankle_pitch)
    R_foot = R_pitch @ rot_x(ankle_roll)
    knee_point = hip - thigh * R_thigh[:, 2]
    ankle_point = knee_point - shank * R_shank[:, 2]
    axes = [R_pelvis[:, 2], R_yaw[:, 0], R_roll[:, 1], R_thigh[:, 1], R_shank[:, 1], R_pitch[:, 0]]
    return jnp.stack([hip, knee_point, ankle_point]), jnp.stack([R_thigh, R_shank, R_foot]), jnp.stack(axes)
