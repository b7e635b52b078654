"""The referee's rule for moving obstacles: whether one of them hits the robot, or the robot hits it."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool

from jaxbiped.arenas.arena import Arena
from jaxbiped.arenas.moving_boxes import boxes_at, only
from jaxbiped.executors.execution import TOUCH, Execution
from jaxbiped.executors.params import ExecutorParams
from jaxbiped.executors.world_state import WorldState
from jaxbiped.geometry.boxes import plan_distance
from jaxbiped.motion.primitives import Command

CHECKS = 64  # moments of a measurement and what follows it: 3 cm of an obstacle's path at 0.02 m/s and 106 s


def hits_moving_box(
    arena: Arena, world: WorldState, command: Command, executed: Execution, params: ExecutorParams
) -> Bool[Array, ""]:
    """Whether a moving box touches one robot while it measures, or while it executes its command.

    The robot is an upright cylinder of the body's radius, from a step above its ground to its head. It stands while it
    measures, and then moves straight and at constant speed to its end position: time for turns is spread over the path.
    """
    if arena.movers is None:
        return jnp.zeros((), bool)
    moving, measuring = only(arena, moving=True), params.durations.measure
    after = jnp.linspace(0.0, 1.0, CHECKS) * (measuring + executed.time)
    part = jnp.clip((after - measuring) / jnp.maximum(executed.time, 1e-3), 0.0, 1.0)
    x = world.pose.x + part * (executed.pose.x - world.pose.x)
    y = world.pose.y + part * (executed.pose.y - world.pose.y)
    foot = jnp.maximum(world.pose.z, executed.pose.z)
    head = foot + jnp.where(command.squat, params.body.squatting, params.body.standing)
    boxes = moving.boxes
    between = boxes.used & (boxes.top > foot + params.body.step + TOUCH) & (boxes.bottom < head - TOUCH)

    def touched(time, x, y):
        return jnp.any(between & (plan_distance(boxes_at(moving, world.time + time), x, y) < params.limits.body_radius))

    return jnp.any(jax.vmap(touched)(after, x, y))
