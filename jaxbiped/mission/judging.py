"""What simulated bipeds and their referee compute between two movements: judge the one, plan the next. All in JAX."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Int

from jaxbiped.arenas.arena import Arena
from jaxbiped.geometry.pose import Pose, to_robot, wrap_angle
from jaxbiped.mission.cycle import conclude, think
from jaxbiped.mission.decision import Thought
from jaxbiped.mission.executors import ODOMETRY, Execution
from jaxbiped.mission.queue import Jobs, begin, pick
from jaxbiped.mission.settings import Program, Settings
from jaxbiped.mission.state import Carriage, Mind, World
from jaxbiped.motion.primitives import Command, duration
from jaxbiped.sensing.hashing import fold
from jaxbiped.sensing.odometry import drift


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Plan:
    """What a robot is at."""

    command: Command
    verdict: Int[Array, "*B"]
    some: Bool[Array, "*B"]  # False before the first decision


def no_plan(size: int) -> Plan:
    """Before the first decision."""
    zero, whole, no = jnp.zeros(size), jnp.zeros(size, jnp.int32), jnp.zeros(size, bool)
    return Plan(Command(turn=zero, primitive=whole, length=zero, rise=whole, squat=no, left=zero), whole, no)


@jax.jit
def gather(tree, rows: Int[Array, "n"]):
    """Rows of every leaf."""
    return pick(tree, rows)


@jax.jit
def scatter(tree, rows: Int[Array, "n"], values):
    """Every leaf with some of its rows replaced; rows beyond its length are dropped."""
    return jax.tree.map(lambda leaf, new: leaf.at[rows].set(new, mode="drop"), tree, values)


@jax.jit
def choose_rows(mask: Bool[Array, "S"], new, old):
    """Rows of `new` where the mask is on, else of `old`."""
    return jax.tree.map(lambda a, b: jnp.where(mask.reshape(-1, *[1] * (a.ndim - 1)), a, b), new, old)


@partial(jax.jit, static_argnames=("program",))
def fresh(arenas: Arena, settings: Settings, jobs: Jobs, job: Int[Array, "S"], program: Program) -> tuple[World, Mind]:
    """See `queue.begin`."""
    return begin(arenas, settings, jobs, job, program)


@partial(jax.jit, static_argnames=("program",))
def judge_and_think(
    world: World,
    mind: Mind,
    plan: Plan,
    after: Pose,
    carriage: Carriage,
    fell: Bool[Array, "n"],
    collided: Bool[Array, "n"],
    arena: Arena,
    settings: Settings,
    program: Program,
) -> tuple[World, Mind, Mind, Plan, Thought]:
    """The referee looks at what came of each robot's plan, and each robot makes its next one.

    Returns:
      The world and the mind after what was done; the mind after the next measurement; the next plan; the thought.
    """
    executed = jax.vmap(carried_out)(world, plan.command, after, fell, collided, arena, settings)
    done = jax.vmap(conclude, in_axes=(0, 0, 0, 0, 0, 0, 0, None))(
        world, mind, plan.command, plan.verdict, executed, arena, settings, program
    )
    world, mind = choose_rows(plan.some, done, (world, mind))
    _, thinking, command, verdict, thought = think(world, mind, arena, settings, program, carriage)
    return world, mind, thinking, Plan(command, verdict, jnp.ones_like(plan.some)), thought


def carried_out(
    world: World,
    command: Command,
    after: Pose,
    fell: Bool[Array, ""],
    collided: Bool[Array, ""],
    arena: Arena,
    settings: Settings,
) -> Execution:
    """What came of a command, from where the engine says that the robot stands after it.

    Odometry counts the true displacement, with the noise of every executor: so much as joints and feet tell of it.
    Time is Table 2's, distance the true one. Consumes channel ODOMETRY of the mission's seed.
    """
    dx, dy = to_robot(world.pose, after.x, after.y)
    seed = fold(world.seed, ODOMETRY, world.decisions)
    moved, variances = drift((dx, dy, wrap_angle(after.yaw - world.pose.yaw)), settings.odometry, seed)
    outside = (after.x < 0) | (after.x > arena.size_xy[0]) | (after.y < 0) | (after.y > arena.size_xy[1])
    return Execution(
        pose=after,
        moved=jnp.stack(moved),
        variances=variances,
        time=duration(command, settings.durations),
        distance=jnp.hypot(dx, dy),
        collided=collided,
        fell=fell & ~collided,
        outside=outside,
    )
