"""The executor that moves exactly as the primitives say, and the referee's rules for it: `kinematic`."""

from __future__ import annotations

import jax.numpy as jnp

from jaxbiped.arenas.arena import Arena
from jaxbiped.arenas.ground import ground_height, rises_near
from jaxbiped.executors.execution import CHECKS, ODOMETRY, TOUCH, Execution
from jaxbiped.executors.params import ExecutorParams
from jaxbiped.executors.world_state import WorldState
from jaxbiped.geometry.boxes import plan_distance
from jaxbiped.geometry.pose import Pose, to_world, wrap_angle
from jaxbiped.jax_settings import with_own_settings
from jaxbiped.motion.primitives import Command, duration
from jaxbiped.sensing.counter_rng import fold
from jaxbiped.sensing.odometry import drift


@with_own_settings
def kinematic(arena: Arena, world: WorldState, command: Command, params: ExecutorParams) -> Execution:
    """Nominal displacement and time (Table 2); odometry drifts with the distance walked.

    Referee, from the true arena: the robot collides if a box between its foot, raised by a step, and its head, or
    terrain above that foot, comes nearer than the body's radius to its axis. It falls if the ground where it ends up is
    not at
    the height that the primitive steps to: a straight step over an edge, or a step up without a bump. Edges may be
    displaced by `edge_tolerance`, and heights may differ by `height_tolerance`.
    """
    limits = params.limits
    cos, sin = jnp.cos(command.turn), jnp.sin(command.turn)
    dx, dy = command.length * cos - command.left * sin, command.length * sin + command.left * cos
    x, y = to_world(world.pose, dx, dy)
    yaw = wrap_angle(world.pose.yaw + command.turn)
    expected = world.pose.z + command.rise * limits.rise
    around = jnp.array([-1.0, 0.0, 1.0]) * limits.edge_tolerance
    grounds = ground_height(arena, x + around * jnp.cos(yaw), y + around * jnp.sin(yaw))
    error = jnp.abs(grounds - expected)
    nearest = jnp.argmin(error)
    z = grounds[nearest]
    fell = error[nearest] > limits.height_tolerance

    head = jnp.where(command.squat, params.body.squatting, params.body.standing)
    collided = jnp.zeros((), bool)
    for part in CHECKS:
        px, py = world.pose.x + part * (x - world.pose.x), world.pose.y + part * (y - world.pose.y)
        foot = jnp.maximum(world.pose.z, expected)
        between = (arena.boxes.top > foot + params.body.step + TOUCH) & (arena.boxes.bottom < foot + head - TOUCH)
        hit = arena.boxes.used & between & (plan_distance(arena.boxes, px, py) < limits.body_radius)
        collided = collided | jnp.any(hit)
        collided = collided | rises_near(arena.terrain, px, py, limits.body_radius, foot + params.body.step + TOUCH)
    outside = (x < 0) | (x > arena.size_xy[0]) | (y < 0) | (y > arena.size_xy[1])

    seed = fold(world.seed, ODOMETRY, world.decisions)
    moved, variances = drift((dx, dy, command.turn), params.odometry, seed)
    return Execution(
        pose=Pose(x, y, z, yaw),
        moved=jnp.stack(moved),
        variances=variances,
        time=duration(command, params.durations),
        distance=jnp.abs(command.length) + jnp.abs(command.left),
        collided=collided,
        fell=fell & ~collided,
        outside=outside,
    )
