"""Executors play a command in the true world; the referee's rules for a nominal one.

An executor is a function `(arena, world, command, settings) -> Execution`, for one arena. `kinematic` is the one that
moves exactly as the primitives say; simulated bipeds are others.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxbiped.arenas.arena import Arena
from jaxbiped.geometry.boxes import ground_height, plan_distance
from jaxbiped.geometry.pose import Pose, to_world, wrap_angle
from jaxbiped.mission.settings import Settings
from jaxbiped.mission.state import World
from jaxbiped.motion.primitives import Command, duration
from jaxbiped.sensing.hashing import fold
from jaxbiped.sensing.odometry import drift

CHECKS = (1 / 3, 2 / 3, 1.0)  # where on its way the body is checked against the boxes
TOUCH = 0.002  # [m] contact that counts as none: rounding, and boxes that just end at a height
ODOMETRY = 2  # channel of a mission's seed


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Execution:
    """What came of one command."""

    pose: Pose  # true, after it
    moved: Float[Array, "*B 3"]  # dx, dy [m], dyaw [rad] by odometry, in the robot frame before it
    variances: Float[Array, "*B 3"]  # of that
    time: Float[Array, "*B"]  # [s]
    distance: Float[Array, "*B"]  # [m]
    collided: Bool[Array, "*B"]
    fell: Bool[Array, "*B"]
    outside: Bool[Array, "*B"]


class Executor(Protocol):
    """Plays one command of one arena."""

    def __call__(self, arena: Arena, world: World, command: Command, settings: Settings) -> Execution: ...


def kinematic(arena: Arena, world: World, command: Command, settings: Settings) -> Execution:
    """Nominal displacement and time (Table 2); odometry drifts from what was walked.

    Referee, from the true arena: the robot collides when a box between its foot, raised by a step, and its head
    comes nearer than the body's radius to its axis. It falls when the ground where it comes to stand is not at the
    height that the primitive steps to: a straight step over an edge, or a step up where no bump is. An edge may lie up
    to `edge_tolerance` off, and the height may be off by `height_tolerance`.
    """
    limits = settings.limits
    cos, sin = jnp.cos(command.turn), jnp.sin(command.turn)
    dx, dy = command.length * cos - command.left * sin, command.length * sin + command.left * cos
    x, y = to_world(world.pose, dx, dy)
    yaw = wrap_angle(world.pose.yaw + command.turn)
    expected = world.pose.z + command.rise * limits.rise
    around = jnp.array([-1.0, 0.0, 1.0]) * limits.edge_tolerance
    grounds = ground_height(arena.boxes, x + around * jnp.cos(yaw), y + around * jnp.sin(yaw))
    error = jnp.abs(grounds - expected)
    nearest = jnp.argmin(error)
    z = grounds[nearest]
    fell = error[nearest] > limits.height_tolerance

    head = jnp.where(command.squat, settings.body.squatting, settings.body.standing)
    collided = jnp.zeros((), bool)
    for part in CHECKS:
        px, py = world.pose.x + part * (x - world.pose.x), world.pose.y + part * (y - world.pose.y)
        foot = jnp.maximum(world.pose.z, expected)
        between = (arena.boxes.top > foot + settings.body.step + TOUCH) & (arena.boxes.bottom < foot + head - TOUCH)
        hit = arena.boxes.used & between & (plan_distance(arena.boxes, px, py) < limits.body_radius)
        collided = collided | jnp.any(hit)
    outside = (x < 0) | (x > arena.size_xy[0]) | (y < 0) | (y > arena.size_xy[1])

    seed = fold(world.seed, ODOMETRY, world.decisions)
    moved, variances = drift((dx, dy, command.turn), settings.odometry, seed)
    return Execution(
        pose=Pose(x, y, z, yaw),
        moved=jnp.stack(moved),
        variances=variances,
        time=duration(command, settings.durations),
        distance=jnp.abs(command.length) + jnp.abs(command.left),
        collided=collided,
        fell=fell & ~collided,
        outside=outside,
    )


EXECUTORS: dict[str, Executor] = {"kinematic": kinematic}
