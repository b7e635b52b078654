"""One turn of the closed loop (paper, Fig. 2): sense, decide, execute; for a batch of missions."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Int

from jaxbiped.arenas.arena import Arena
from jaxbiped.arenas.moving_boxes import at_time, only
from jaxbiped.executors.execution import Execution, execution_of
from jaxbiped.executors.moving_collisions import hits_moving_box
from jaxbiped.executors.world_state import BodyPose, WorldState
from jaxbiped.geometry.pose import wrap_angle
from jaxbiped.localisation.kalman_filter import predict
from jaxbiped.mission.decision import DecisionTrace, climbed, decide
from jaxbiped.mission.foot_placement import update_edges
from jaxbiped.mission.localising import anchor_after_odometry, sightings_without_landmarks
from jaxbiped.mission.metric import Step, updated
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import MissionParams
from jaxbiped.mission.sensors import Oracle, RayCast, Standpoint, view_of
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.state import AgentState
from jaxbiped.motion.primitives import Command
from jaxbiped.sensing import landmarks
from jaxbiped.sensing.counter_rng import fold
from jaxbiped.sensing.view import Sightings, View

SENSE = 1  # channel of a mission's seed
TRUSTED = (RayCast, Oracle, type(None))  # sensors whose numbers are finite


def step(
    world: WorldState,
    agent: AgentState,
    setup: MissionSetup,
    seen: tuple[View, Sightings] | None = None,
) -> tuple[WorldState, AgentState, View, Command, DecisionTrace]:
    """Advance every mission of the batch by one decision. Missions that have ended do not change.

    Consumes channels SENSE and ODOMETRY of each mission's seed, counted by its decisions.

    Args:
      seen: what each robot has just measured; None: measure here, with a sensor in JAX.
    """
    view, thinking, command, verdict, thought = sense_and_decide(world, agent, setup, seen=seen)
    executed = carry_out(world, command, setup)
    after, moved = jax.vmap(apply_outcome)(world, thinking, command, verdict, executed, setup)
    running = world.code == Code.RUNNING
    after = jax.tree.map(lambda new, old: jnp.where(running.reshape(-1, *[1] * (new.ndim - 1)), new, old), after, world)
    return after, moved, view, command, thought


def carry_out(world: WorldState, command: Command, setup: MissionSetup) -> Execution:
    """Execute the command of each robot, among standing and moving boxes."""
    play, arena, params = jax.vmap(played), setup.arena, setup.params
    if arena.movers is None:
        return play(arena, world, command, params)
    executed = play(jax.vmap(partial(only, moving=False))(arena), world, command, params)
    run_into = jax.vmap(hits_moving_box)(arena, world, command, executed, params)
    return replace(executed, collided=executed.collided | run_into, fell=executed.fell & ~run_into)


def played(arena: Arena, world: WorldState, command: Command, params: MissionParams) -> Execution:
    """Execute the command of one robot."""
    return execution_of(params.executor, arena, world, command, params)


def sense_and_decide(
    world: WorldState,
    agent: AgentState,
    setup: MissionSetup,
    body_pose: BodyPose | None = None,
    seen: tuple[View, Sightings] | None = None,
) -> tuple[View, AgentState, Command, Int[Array, "B"], DecisionTrace]:
    """Sense and decide, for a batch: the view, and what `decide` returns. Consumes channel SENSE.

    Args:
      body_pose: [B] true pose of each robot's body; None: upright, except for a tilt drawn by the sensor.
      seen: what each robot has just measured; None: measure here.
    """
    if seen is None:
        arena = setup.arena
        now = setup if arena.movers is None else replace(setup, arena=jax.vmap(at_time)(arena, world.time))
        seen = jax.vmap(sense)(world, agent, now, body_pose)
    # Without the barrier, XLA fuses the camera into the map and repeats the measurement for each use of a point.
    view, sightings = jax.lax.optimization_barrier(seen)
    if setup.spec.knows_pose:
        agent = replace(agent, belief=replace(agent.belief, pose=world.pose))
    active = world.code == Code.RUNNING
    if type(setup.params.sensor) in TRUSTED:
        return view, *decide(agent, view, sightings, setup, active)
    broken = jnp.any(jnp.isnan(view.weight), axis=-1)
    view = replace(view, weight=jnp.where(broken[:, None], 0.0, view.weight))
    agent, command, verdict, thought = decide(agent, view, sightings, setup, active)
    return view, agent, command, jnp.where(broken & active, Code.INVALID, verdict), thought


def sense(
    world: WorldState, agent: AgentState, setup: MissionSetup, body_pose: BodyPose | None
) -> tuple[View, Sightings]:
    """The measurement of one robot from its true position, and with the true pose of its body."""
    arena, params, spec = setup.arena, setup.params, setup.spec
    pose = world.pose if body_pose is None else body_pose.pose
    attitude = None if body_pose is None else (body_pose.roll, body_pose.pitch)
    seed = fold(world.seed, SENSE, world.decisions)
    if params.sensor is None:
        raise ValueError(f"the sensor {spec.sensor} measures on the host: its missions must be given their views")
    at = Standpoint(world.pose if spec.knows_pose else pose, agent.look, world.squat, attitude, seed)
    view = view_of(params.sensor, arena, at, params, spec)
    if spec.localisation != "landmarks":
        return view, sightings_without_landmarks(view, world, agent, setup, seed)
    return view, landmarks.sight(
        arena, pose, params.camera, params.landmarks, spec.image, seed, agent.look, world.squat
    )


def apply_outcome(
    world: WorldState,
    agent: AgentState,
    command: Command,
    verdict: Int[Array, ""],
    executed: Execution,
    setup: MissionSetup,
) -> tuple[WorldState, AgentState]:
    """Update one mission after its command: the robot integrates its odometry, the referee checks."""
    arena, params = setup.arena, setup.params
    stays = verdict != Code.RUNNING
    belief = predict(agent.belief, *executed.moved, executed.variances)
    belief = replace(belief, pose=climbed(belief.pose, command.rise, setup.spec.grid))
    pose = jax.tree.map(lambda new, old: jnp.where(stays, old, new), executed.pose, world.pose)
    acted = jnp.where(stays, 0.0, executed.time)
    time = world.time + params.durations.measure + acted
    decisions = world.decisions + 1
    away = jnp.hypot(arena.goal_xy[0] - pose.x, arena.goal_xy[1] - pose.y)

    code = jnp.where(decisions >= params.limits.max_decisions, Code.OUT_OF_STEPS, Code.RUNNING)
    code = jnp.where(stays, verdict, code)
    code = jnp.where(away <= params.limits.goal_radius, Code.REACHED, code)
    code = jnp.where(~stays & executed.outside, Code.OUT_OF_BOUNDS, code)
    code = jnp.where(~stays & executed.fell, Code.FELL, code)
    code = jnp.where(~stays & executed.collided, Code.COLLIDED, code)
    astray = jnp.hypot(belief.pose.x - pose.x, belief.pose.y - pose.y)
    sane = jnp.isfinite(away + time + pose.yaw + belief.pose.x + belief.pose.y + belief.pose.yaw)
    code = jnp.where(sane, code, Code.INVALID).astype(jnp.int32)
    after = WorldState(
        pose=pose,
        squat=jnp.where(stays, world.squat, command.squat),
        distance=world.distance + jnp.where(stays, 0.0, executed.distance),
        time=time,
        measurements=world.measurements + 1,
        decisions=decisions,
        code=code,
        seed=world.seed,
        pose_error=astray,
        yaw_error=jnp.abs(wrap_angle(belief.pose.yaw - pose.yaw)),
        before=None if world.before is None else world.pose,
        planned=agent.planned,
    )
    if params.metrics:
        step = Step(arena, world, after, command, ~stays, params)
        after = replace(after, metrics=updated(params.metrics, world.metrics, step))
    agent = anchor_after_odometry(
        update_edges(agent, command, executed.moved, executed.variances), executed.moved, executed.variances
    )
    return after, replace(agent, belief=belief, since=params.durations.measure + acted)
