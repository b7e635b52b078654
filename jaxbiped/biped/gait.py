"""Primitives as tables of joint targets, generated from the zero moment point and the feet.

Minimum-jerk references of the feet and of the zero moment point -> centre of mass (linear inverted pendulum) -> pelvis,
on the centre of mass of all links -> joint angles (exact inverse kinematics) -> targets of the servos, with the torque
that holds the posture and the drag of the moving servo fed forward. All primitives start and end at rest in the same
posture on both feet (one standing, one squatting), so that chains of them are seamless.
"""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxbiped.biped.config import JOINT_NAMES, RobotModelConfig
from jaxbiped.biped.leg import Biped
from jaxbiped.biped.request import Request
from jaxbiped.biped.score import Score, channels, compose, hip_height, ramp, schedule
from jaxbiped.biped.whole_body import link_masses, posture
from jaxbiped.biped.zmp import com_from_zmp, zmp_of_masses
from jaxbiped.errors import InputError

KNOTS = 1024  # samples of a movement of any duration: every primitive runs through one compiled function
TIMESTEP = 0.005  # [s] of a table
DIRECTIONS = 72  # in which the support polygon's width is tabulated
FILTER_ROUNDS = 2  # corrections of the pendulum's reference by the effect of the links' masses
REACH_MARGIN = 0.001  # [m] distance of a leg from straight, where its kinematics are singular


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Motion:
    """A movement at equal steps of time, `KNOTS` of them by default."""

    time: Float[Array, "N"]  # [s]
    q: Float[Array, "N 12"]  # [rad]
    torque: Float[Array, "N 12"]  # [Nm] at rest
    com: Float[Array, "N 2"]  # [m] planned centre of mass
    zmp: Float[Array, "N 2"]  # [m] zero moment point of the links' masses
    margin: Float[Array, "N"]  # [m] distance of the zero moment point inside the support polygon
    feet: Float[Array, "N 2 4"]  # (x, y, z, yaw) of the left and the right sole
    pelvis: Float[Array, "N 3"]  # [m]
    slack: Float[Array, "N 2"]  # [m] remaining reach of each leg


@dataclass(frozen=True)
class PrimitiveTable:
    """A primitive to play: rows at `timestep`, the first one step after the start, the last one at the end.

    World frame of the primitive: origin between the feet at the start, x ahead, z = 0 the ground there.
    """

    request: Request
    timestep: float  # [s]
    duration: float  # [s] of all rows
    phases: tuple[tuple[str, float], ...]  # name and end [s]
    q: np.ndarray  # [T, 12] [rad] joint angles in the order of JOINT_NAMES
    ctrl: np.ndarray  # [T, 12] [rad] targets of the servos
    com: np.ndarray  # [T, 2] [m]
    zmp: np.ndarray  # [T, 2] [m]
    feet: np.ndarray  # [T, 2, 4] (x, y, z, yaw) of the soles [m, rad]
    pelvis: np.ndarray  # [T, 3] [m]
    margin: float  # [m] smallest distance of the planned zero moment point from the support polygon's edge
    peak_speed: float  # [rad/s] of any joint
    peak_torque: float  # [Nm] of any joint, at rest


@functools.partial(jax.jit, static_argnames="knots")
def perform(score: Score, biped: Biped, com_height: Float[Array, ""], knots: int = KNOTS) -> Motion:
    """Play a score: everything of a movement except the checks. Compiled once; durations, lengths and robot are traced.

    Args:
      com_height: [m] height of the pendulum.
      knots: samples; static.
    """
    total = jnp.sum(score.durations)
    dt = total / (knots - 1)
    time = jnp.arange(knots) * dt
    values, swing = channels(score, time)
    reference, load, hip = values[:, :2], values[:, 2], values[:, 3]
    feet = values[:, 4:].reshape(knots, 2, 4)
    # The pressure on each foot is offset from its middle like the zero moment point from the line between the feet.
    share = jnp.stack([load, 1.0 - load], axis=1)
    off = reference - jnp.sum(share[..., None] * feet[..., :2], axis=1)
    pressure = feet[..., :2] + off[:, None]
    pose = jax.vmap(posture, (None, 0, 0, 0, 0, 0))
    ground = jnp.sum(share * feet[..., 2], axis=1)
    masses = link_masses(biped)

    def correct(wanted, _):
        com = com_from_zmp(wanted, com_height, dt)
        real = zmp_of_masses(pose(biped, com, hip, feet, load, pressure).links, masses, ground, dt)
        return wanted + (reference - real), None

    # The pendulum looks slightly beyond its rests; the ends are made exact below.
    wanted, _ = jax.lax.scan(correct, reference, None, length=FILTER_ROUNDS)
    com = settle(com_from_zmp(wanted, com_height, dt), reference[0], reference[-1], score, time)
    held = pose(biped, com, hip, feet, load, pressure)
    zmp = zmp_of_masses(held.links, masses, ground, dt)
    margin = support_margin(biped, feet, swing, zmp)
    return Motion(time, held.q, held.torque, com, zmp, margin, feet, held.pelvis, held.slack)


def settle(
    com: Float[Array, "N 2"], start: Float[Array, "2"], end: Float[Array, "2"], score: Score, time: Float[Array, "N"]
) -> Float[Array, "N 2"]:
    """Fade the centre of mass from and into exact rest over the first and the last phase, on both feet."""
    last = score.durations[jnp.sum(score.durations > 0) - 1]
    from_start, to_end = ramp(time / score.durations[0])[:, None], ramp((time[-1] - time) / last)[:, None]
    com = start + from_start * (com - start)
    return end + to_end * (com - end)


def support_margin(
    biped: Biped, feet: Float[Array, "N 2 4"], swing: Float[Array, "N 2"], point: Float[Array, "N 2"]
) -> Float[Array, "N"]:
    """Distance [m] of a point from the edge of the support polygon, negative outside.

    The polygon's width is tabulated in `DIRECTIONS` directions, including those perpendicular to the feet; between them
    the distance is at most 0.1 mm too large, with feet of 10 cm.
    """
    length, width = biped.foot
    corners = jnp.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]]) * jnp.stack([length, width]) / 2
    cos, sin = jnp.cos(feet[..., 3])[..., None], jnp.sin(feet[..., 3])[..., None]
    turned = jnp.stack([cos * corners[:, 0] - sin * corners[:, 1], sin * corners[:, 0] + cos * corners[:, 1]], axis=-1)
    on_ground = (feet[:, :, None, :2] + turned).reshape(-1, 8, 2) - point[:, None]
    angles = jnp.arange(DIRECTIONS) * (2 * jnp.pi / DIRECTIONS) + jnp.mean(feet[..., 3], axis=1)[:, None]
    normals = jnp.stack([jnp.cos(angles), jnp.sin(angles)], axis=-1)
    reach = jnp.einsum("ncx,ndx->ndc", on_ground, normals)
    reach = jnp.where(jnp.repeat(swing, 4, axis=1)[:, None, :] > 0, -jnp.inf, reach)
    return jnp.min(jnp.max(reach, axis=2), axis=1)


def generate(request: Request, robot: RobotModelConfig, durations: np.ndarray | None = None) -> PrimitiveTable:
    """The primitive as a table.

    Args:
      durations: [s] of the phases, instead of those of `schedule`; they replace the request's duration.

    Raises:
      InputError: a leg cannot reach, a joint leaves its range, or a servo would exceed its speed or torque; the message
        says which and when.
    """
    song = compose(request, robot)
    if durations is None:
        durations = schedule(song, request.duration)
    if np.min(durations) <= 0.0:
        raise InputError(
            "too short: no time is left for steps", field=f"{request.name}: duration", value=request.duration
        )
    biped = robot.traced()
    motion = perform(song.score(durations), biped, pendulum_height(request, robot))
    return tabulate(request, robot, song.names, durations, jax.device_get(motion))


@functools.lru_cache(maxsize=64)
def home_table(robot: RobotModelConfig, squatting: bool) -> PrimitiveTable:
    """Standing, or squatting, still: the last row is the posture in which every primitive starts and ends."""
    return generate(Request("home", squat_start=squatting, squat=squatting, squat_end=squatting, duration=1.0), robot)


def pendulum_height(request: Request, robot: RobotModelConfig) -> Float[Array, ""]:
    """Mean height [m] of the centre of mass above the ground, roughly: the filter corrects the rest."""
    return jnp.float32(hip_height(request, robot) + 0.01)


def tabulate(
    request: Request, robot: RobotModelConfig, names: list[str], durations: np.ndarray, motion: Motion
) -> PrimitiveTable:
    """Check a movement against the robot's limits and sample it at `TIMESTEP`."""
    from scipy.interpolate import CubicSpline

    time = motion.time.astype(np.float64)
    _check_reach(request, motion)
    rows = max(1, round(time[-1] / TIMESTEP))
    at = np.arange(1, rows + 1) * (time[-1] / rows)  # the last phase ends with the last row
    spline = CubicSpline(time, motion.q.astype(np.float64), bc_type="clamped")
    q, speed = spline(at), spline(at, 1)
    torque = CubicSpline(time, motion.torque.astype(np.float64))(at)
    _check(request, q, robot.limits()[:, 0], robot.limits()[:, 1], at, "deg", "range")
    fastest = np.deg2rad(robot.servo.speed)
    _check(request, speed, -fastest, fastest, at, "deg/s", "speed")
    _check(request, torque, -robot.servo.torque, robot.servo.torque, at, "Nm", "torque")
    drag = (robot.servo.kv + robot.servo.damping) * speed
    sample = lambda values: np.stack([np.interp(at, time, v) for v in values.reshape(len(time), -1).T], axis=1)  # noqa: E731
    return PrimitiveTable(
        request=dataclasses.replace(request, duration=rows * TIMESTEP),
        timestep=TIMESTEP,
        duration=rows * TIMESTEP,
        phases=tuple(zip(names, np.cumsum(durations).tolist(), strict=True)),
        q=q,
        ctrl=q + (torque + drag) / robot.servo.kp,
        com=sample(motion.com),
        zmp=sample(motion.zmp),
        feet=sample(motion.feet).reshape(-1, 2, 4),
        pelvis=sample(motion.pelvis),
        margin=float(motion.margin.min()),
        peak_speed=float(np.abs(speed).max()),
        peak_torque=float(np.abs(torque).max()),
    )


def _check_reach(request: Request, motion: Motion) -> None:
    k, leg = np.unravel_index(np.argmin(motion.slack), motion.slack.shape)
    if not motion.slack[k, leg] >= REACH_MARGIN:
        raise InputError(
            f"the {('left', 'right')[leg]} leg is {1000 * (REACH_MARGIN - motion.slack[k, leg]):.1f} mm too short "
            f"at {motion.time[k]:.2f} s; ask for a shorter or lower step, or lower the hips (stance)",
            field=request.name,
        )


def _check(request: Request, values: np.ndarray, low, high, at: np.ndarray, unit: str, what: str) -> None:
    beyond = np.maximum(low - values, values - high)
    k, joint = np.unravel_index(np.argmax(beyond), beyond.shape)
    if not beyond[k, joint] <= 1e-6:
        scale = 1.0 if unit == "Nm" else np.degrees(1.0)
        bounds = np.broadcast_to(low, 12)[joint] * scale, np.broadcast_to(high, 12)[joint] * scale
        advice = "; ask for a longer duration" if what == "speed" else ""
        raise InputError(
            f"{JOINT_NAMES[joint]} leaves its {what} at {at[k]:.2f} s: {values[k, joint] * scale:.1f} {unit}, "
            f"allowed {bounds[0]:.1f} to {bounds[1]:.1f}{advice}",
            field=request.name,
        )
