"""What simulated bipeds and their referee compute between two movements: judge the last, plan the next. All in JAX."""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.executors.execution import ODOMETRY, Execution
from jaxbiped.executors.world_state import BodyPose, WorldState
from jaxbiped.geometry.pose import Pose, to_robot, to_world, wrap_angle
from jaxbiped.mapping import Cell, GridSpec
from jaxbiped.mission.batched_driver import Jobs, begin, pick
from jaxbiped.mission.decision import DecisionTrace
from jaxbiped.mission.mission_step import apply_outcome, sense_and_decide
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.state import AgentState
from jaxbiped.motion.primitives import Command, Primitive, duration
from jaxbiped.motion.selection import cell_of
from jaxbiped.sensing.counter_rng import fold
from jaxbiped.sensing.odometry import drift
from jaxbiped.sensing.view import Sightings, View

HINDERED, TWISTED = 0.02, 0.1  # [m, rad] deviation from a command's target that indicates an obstruction
PATIENCE = 2  # successive hindered commands before the robot believes its feet
TOUCH_VOTES = 1e5  # [px] contact felt by the feet outvotes everything seen
BACK = 0.04  # [m] length of a step backward


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Plan:
    """The current action of a robot."""

    command: Command
    verdict: Int[Array, "*B"]
    some: Bool[Array, "*B"]  # False before the first decision
    hindered: Int[Array, "*B"]  # number of successive hindered commands before this one


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class PlanEnd:
    """How an action ended, according to the engine."""

    pose: Pose  # of the midpoint of the soles
    fell: Bool[Array, "*B"]
    collided: Bool[Array, "*B"]


def no_plan(size: int) -> Plan:
    """The plan before the first decision."""
    zero, whole, no = jnp.zeros(size), jnp.zeros(size, jnp.int32), jnp.zeros(size, bool)
    return Plan(Command(turn=zero, primitive=whole, length=zero, rise=whole, squat=no, left=zero), whole, no, whole)


@jax.jit
def gather(tree, rows: Int[Array, "n"]):
    """Rows of every leaf."""
    return pick(tree, rows)


@jax.jit
def scatter(tree, rows: Int[Array, "n"], values):
    """Replace some rows of every leaf; rows beyond its length are dropped."""
    return jax.tree.map(lambda leaf, new: leaf.at[rows].set(new, mode="drop"), tree, values)


@jax.jit
def choose_rows(mask: Bool[Array, "S"], new, old):
    """Rows of `new` where the mask is on, else of `old`."""
    return jax.tree.map(lambda a, b: jnp.where(mask.reshape(-1, *[1] * (a.ndim - 1)), a, b), new, old)


@jax.jit
def fresh(setup: MissionSetup, jobs: Jobs, job: Int[Array, "S"]) -> tuple[WorldState, AgentState]:
    """See `batched_driver.begin`."""
    return begin(setup, jobs, job)


@jax.jit
def judge_and_decide(
    world: WorldState,
    agent: AgentState,
    plan: Plan,
    ending: PlanEnd,
    body_pose: BodyPose,
    setup: MissionSetup,
) -> tuple[WorldState, AgentState, AgentState, Plan, DecisionTrace]:
    """The referee judges each robot's last plan, and each robot makes its next one.

    Returns:
      The world and the agent after the action; the agent after the next measurement; the next plan; the trace.
    """
    world, agent, times = judge(world, agent, plan, ending, setup)
    return world, agent, *decide_next(world, agent, times, body_pose, setup)


@jax.jit
def judge(
    world: WorldState,
    agent: AgentState,
    plan: Plan,
    ending: PlanEnd,
    setup: MissionSetup,
) -> tuple[WorldState, AgentState, Int[Array, "n"]]:
    """The referee judges the outcome of each robot's plan.

    Deviation: the paper's robot knows only what it sees. Here, feet that were stopped `PATIENCE` times in a row, by an
    edge that the map has elsewhere, make the robot step back and plan around that cell.

    Returns:
      The world and the agent after the action; how many successive commands were hindered.
    """
    executed = jax.vmap(execute)(world, plan.command, ending, setup)
    done = jax.vmap(apply_outcome)(world, agent, plan.command, plan.verdict, executed, setup)
    times = jnp.where(plan.some & hindered(plan.command, executed.moved), plan.hindered + 1, 0)
    felt = jax.vmap(feel, in_axes=(0, 0, 0, None))(done[1], agent.belief.pose, plan.command, setup.spec.grid)
    done = done[0], choose_rows(times >= PATIENCE, felt, done[1])
    return *choose_rows(plan.some, done, (world, agent)), times


@jax.jit
def decide_next(
    world: WorldState,
    agent: AgentState,
    times: Int[Array, "n"],
    body_pose: BodyPose,
    setup: MissionSetup,
    seen: tuple[View, Sightings] | None = None,
) -> tuple[AgentState, Plan, DecisionTrace]:
    """Each robot measures, or has `seen`, and makes its next plan; `times` is the count returned by `judge`.

    Returns:
      The agent after the measurement; the plan; the trace.
    """
    _, thinking, command, verdict, thought = sense_and_decide(world, agent, setup, body_pose, seen)
    stuck = times >= PATIENCE
    command = choose_rows(stuck & (verdict == Code.RUNNING), back_off(command), command)
    return thinking, Plan(command, verdict, jnp.ones_like(stuck), jnp.where(stuck, 0, times)), thought


def hindered(command: Command, moved: Float[Array, "n 3"]) -> Bool[Array, "n"]:
    """Whether feet hit something low: by odometry [n, 3], the robot is not where its command leads.

    Steps over an edge do not count, nor do commands hindered while backing off.
    """
    cos, sin = jnp.cos(command.turn), jnp.sin(command.turn)
    x, y = command.length * cos - command.left * sin, command.length * sin + command.left * cos
    off = jnp.hypot(moved[:, 0] - x, moved[:, 1] - y)
    astray = jnp.abs(wrap_angle(moved[:, 2] - command.turn))
    return ((off > HINDERED) | (astray > TWISTED)) & (command.rise == 0) & (command.length >= 0)


def feel(agent: AgentState, before: Pose, command: Command, grid: GridSpec) -> AgentState:
    """Write an obstacle into the map of one robot, at the cell where hindered feet should have ended.

    If it stands in that cell, the cell behind it is used.
    """
    yaw = before.yaw + command.turn
    ahead = Pose(before.x, before.y, before.z, yaw)
    own = cell_of(agent.belief.pose.x, agent.belief.pose.y, grid)
    there = cell_of(*to_world(ahead, command.length, command.left), grid)
    beyond = cell_of(*to_world(ahead, command.length + grid.pitch, command.left), grid)
    i, j = jnp.where(jnp.all(there == own), beyond, there)
    votes = agent.grid_map.votes.at[i, j, Cell.OBSTACLE - 1].add(TOUCH_VOTES)
    return replace(agent, grid_map=replace(agent.grid_map, votes=votes))


def back_off(command: Command) -> Command:
    """A step backward instead of the decided command."""
    zero, whole = jnp.zeros_like(command.length), jnp.zeros_like(command.primitive)
    return Command(
        turn=zero,
        primitive=whole + Primitive.STRAIGHT_FORWARD,
        length=zero - BACK,
        rise=whole,
        squat=command.squat,
        left=zero,
    )


def execute(world: WorldState, command: Command, ending: PlanEnd, setup: MissionSetup) -> Execution:
    """The outcome of a command, from the robot's pose afterwards according to the engine.

    Odometry counts the true displacement with the noise of every executor, since joints and feet can measure that.
    Time is Table 2's, distance the true one. Consumes channel ODOMETRY of the mission's seed.
    """
    after, arena, params = ending.pose, setup.arena, setup.params
    dx, dy = to_robot(world.pose, after.x, after.y)
    seed = fold(world.seed, ODOMETRY, world.decisions)
    moved, variances = drift((dx, dy, wrap_angle(after.yaw - world.pose.yaw)), params.odometry, seed)
    outside = (after.x < 0) | (after.x > arena.size_xy[0]) | (after.y < 0) | (after.y > arena.size_xy[1])
    return Execution(
        pose=after,
        moved=jnp.stack(moved),
        variances=variances,
        time=duration(command, params.durations),
        distance=jnp.hypot(dx, dy),
        collided=ending.collided,
        fell=ending.fell & ~ending.collided,
        outside=outside,
    )
