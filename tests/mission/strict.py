"""A referee that is strict about feet: the executor `strict`, for tests and for tuning of foot placement.

It moves as `kinematic` does, with an error of its own, and looks at where the edge really lies under each step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped.core.registry import EXECUTORS
from jaxbiped.executors.execution import Executor
from jaxbiped.executors.kinematic_executor import kinematic
from jaxbiped.geometry.boxes import ground_height
from jaxbiped.geometry.pose import Pose, to_world
from jaxbiped.motion.primitives import Primitive

FINE = np.arange(-0.06, 0.2401, 0.001, dtype=np.float32)  # [m] ahead of the robot, where edges are looked for
SIDE = 0.045  # [m] to both sides, before the middle of each foot, where they are looked for as well
TOLERANCE = 0.012  # [m] that an edge may lie off its place: 8 mm are fine for a simulated biped, 25 mm fail
ASKEW = np.deg2rad(8.0)  # that it may be off square
TOES = np.array([-0.05, 0.0, 0.05], np.float32)  # [m] where feet are looked at, along and across
SOLES = np.array([-0.07, -0.045, -0.02, 0.02, 0.045, 0.07], np.float32)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Footfall:
    """The truth about a step over an edge."""

    off: jax.Array  # [m] how much further than nominal the edge lies
    askew: jax.Array  # [rad] of its normal, from the heading
    found: jax.Array  # an edge of the right sort lies ahead


def footfall(arena, pose, rise, footing) -> Footfall:
    """Of the edge ahead of a pose, on both sides."""

    def first(side):
        x, y = to_world(pose, jnp.asarray(FINE), side + jnp.zeros(FINE.shape))
        rises = ground_height(arena.boxes, x, y) - pose.z > 0.5 * rise * 0.03
        crossed = jnp.where(rise > 0, rises, ~(ground_height(arena.boxes, x, y) - pose.z > -0.015))
        before = jnp.concatenate([jnp.ones(1, bool), ~crossed[:-1]])
        k = jnp.argmax(crossed & before)
        return jnp.asarray(FINE)[k] - 0.0005, jnp.any(crossed) & (k > 0)

    (a, found_a), (b, found_b), (c, found_c) = (first(side) for side in (-SIDE, 0.0, SIDE))
    nominal = jnp.where(rise > 0, footing.before_up, footing.before_down)
    return Footfall(b - nominal, jnp.arctan2(a - c, 2 * SIDE), found_a & found_b & found_c)


def stands(arena, pose, slack):
    """Whether all of the feet are on level ground, but for `slack` [m] at their rims; ankles at least."""
    along, across = np.meshgrid(TOES, SOLES, indexing="ij")
    shrink = np.where(along == 0, 1.0, 1 - slack / 0.05)
    x, y = to_world(pose, jnp.asarray((along * shrink).ravel(), jnp.float32), jnp.asarray(across.ravel()))
    ground = ground_height(arena.boxes, x, y) - pose.z
    ankle = (along.ravel() == 0) & (np.abs(across.ravel()) == np.float32(0.045))
    tripped = jnp.any(ground > 0.01)
    return ~tripped, ~jnp.any(ankle & (ground < -0.01))


def strict(arena, world, command, params):
    """As `kinematic`, but a step falls when the edge lies off its place, or off square."""
    done = kinematic(arena, world, replace(command, rise=0 * command.rise), params)
    done = replace(done, fell=jnp.zeros((), bool))
    yaw = world.pose.yaw + command.turn
    turned = Pose(world.pose.x, world.pose.y, world.pose.z, yaw)
    fall = footfall(arena, turned, command.rise, params.footing)
    stepped = (command.primitive == Primitive.STEP_UP_BUMP) | (command.primitive == Primitive.STEP_DOWN_BUMP)
    good = fall.found & (jnp.abs(fall.off) < TOLERANCE) & (jnp.abs(fall.askew) < ASKEW)
    pose = replace(done.pose, z=world.pose.z + command.rise * params.limits.rise)
    clean, held = stands(arena, pose, 0.008)
    walks = (jnp.abs(command.length) + jnp.abs(command.turn) + jnp.abs(command.left)) > 0
    bad = jnp.where(stepped, ~good, walks & ~(clean & held))
    return replace(done, pose=pose, fell=bad & ~done.collided)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Strict(Executor):
    """See `strict`."""

    places_feet = True

    def execute(self, arena, world, command, params):
        return strict(arena, world, command, params)


EXECUTORS.add("strict", Strict())
