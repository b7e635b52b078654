"""One turn of the closed loop (paper, Fig. 2): sense, decide, execute; for a batch of missions."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Int

from jaxbiped.arenas.arena import Arena
from jaxbiped.arenas.moving_boxes import at_time, only
from jaxbiped.geometry.pose import wrap_angle
from jaxbiped.localisation.kalman_filter import predict
from jaxbiped.mission.decision import DecisionTrace, climbed, decide
from jaxbiped.mission.execution import Execution, execution_of
from jaxbiped.mission.foot_placement import walked
from jaxbiped.mission.localising import carried_on, unmarked
from jaxbiped.mission.metric import Step, updated
from jaxbiped.mission.moving_collisions import met
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.sensors import Oracle, RayCast, Standpoint, view_of
from jaxbiped.mission.settings import MissionParams, MissionSpec
from jaxbiped.mission.state import AgentState, BodyPose, WorldState
from jaxbiped.motion.primitives import Command
from jaxbiped.sensing import landmarks
from jaxbiped.sensing.counter_rng import fold
from jaxbiped.sensing.view import Sightings, View

SENSE = 1  # channel of a mission's seed
TRUSTED = (RayCast, Oracle, type(None))  # sensors whose numbers are finite


def step(
    world: WorldState,
    mind: AgentState,
    arena: Arena,
    settings: MissionParams,
    program: MissionSpec,
    seen: tuple[View, Sightings] | None = None,
) -> tuple[WorldState, AgentState, View, Command, DecisionTrace]:
    """Advance every mission of the batch by one decision. Missions that have ended do not change.

    Consumes channels SENSE and ODOMETRY of each mission's seed, counted by its decisions.

    Args:
      seen: what each robot has just measured; None: measure here, with a sensor in JAX.
    """
    view, thinking, command, verdict, thought = sense_and_decide(world, mind, arena, settings, program, seen=seen)
    executed = carry_out(arena, world, command, settings, program)
    after, moved = jax.vmap(apply_outcome, in_axes=(0, 0, 0, 0, 0, 0, 0, None))(
        world, thinking, command, verdict, executed, arena, settings, program
    )
    running = world.code == Code.RUNNING
    after = jax.tree.map(lambda new, old: jnp.where(running.reshape(-1, *[1] * (new.ndim - 1)), new, old), after, world)
    return after, moved, view, command, thought


def carry_out(
    arena: Arena, world: WorldState, command: Command, settings: MissionParams, program: MissionSpec
) -> Execution:
    """Execute the command of each robot, among standing and moving boxes."""
    play = jax.vmap(played)
    if arena.movers is None:
        return play(arena, world, command, settings)
    executed = play(jax.vmap(partial(only, moving=False))(arena), world, command, settings)
    run_into = jax.vmap(met)(arena, world, command, executed, settings)
    return replace(executed, collided=executed.collided | run_into, fell=executed.fell & ~run_into)


def played(arena: Arena, world: WorldState, command: Command, settings: MissionParams) -> Execution:
    """Execute the command of one robot."""
    return execution_of(settings.executor, arena, world, command, settings)


def sense_and_decide(
    world: WorldState,
    mind: AgentState,
    arena: Arena,
    settings: MissionParams,
    program: MissionSpec,
    carriage: BodyPose | None = None,
    seen: tuple[View, Sightings] | None = None,
) -> tuple[View, AgentState, Command, Int[Array, "B"], DecisionTrace]:
    """Sense and decide, for a batch: the view, and what `decide` returns. Consumes channel SENSE.

    Args:
      carriage: [B] true pose of each robot's body; None: upright, except for a tilt drawn by the sensor.
      seen: what each robot has just measured; None: measure here.
    """
    if seen is None:
        now = arena if arena.movers is None else jax.vmap(at_time)(arena, world.time)
        seen = jax.vmap(sense, in_axes=(0, 0, 0, 0, None, 0))(world, mind, now, settings, program, carriage)
    # Without the barrier, XLA fuses the camera into the map and repeats the measurement for each use of a point.
    view, sightings = jax.lax.optimization_barrier(seen)
    if program.knows_pose:
        mind = replace(mind, belief=replace(mind.belief, pose=world.pose))
    active = world.code == Code.RUNNING
    if type(settings.sensor) in TRUSTED:
        return view, *decide(mind, view, sightings, arena, settings, program, active)
    broken = jnp.any(jnp.isnan(view.weight), axis=-1)
    view = replace(view, weight=jnp.where(broken[:, None], 0.0, view.weight))
    mind, command, verdict, thought = decide(mind, view, sightings, arena, settings, program, active)
    return view, mind, command, jnp.where(broken & active, Code.INVALID, verdict), thought


def sense(
    world: WorldState,
    mind: AgentState,
    arena: Arena,
    settings: MissionParams,
    program: MissionSpec,
    carriage: BodyPose | None,
) -> tuple[View, Sightings]:
    """The measurement of one robot from its true position, and with the true pose of its body."""
    pose = world.pose if carriage is None else carriage.pose
    attitude = None if carriage is None else (carriage.roll, carriage.pitch)
    seed = fold(world.seed, SENSE, world.decisions)
    if settings.sensor is None:
        raise ValueError(f"the sensor {program.sensor} measures on the host: its missions must be given their views")
    at = Standpoint(world.pose if program.knows_pose else pose, mind.look, world.squat, attitude, seed)
    view = view_of(settings.sensor, arena, at, settings, program)
    if program.localisation != "landmarks":
        return view, unmarked(view, world, mind, arena, settings, program, seed)
    return view, landmarks.sight(
        arena, pose, settings.camera, settings.landmarks, program.image, seed, mind.look, world.squat
    )


def apply_outcome(
    world: WorldState,
    mind: AgentState,
    command: Command,
    verdict: Int[Array, ""],
    executed: Execution,
    arena: Arena,
    settings: MissionParams,
    program: MissionSpec,
) -> tuple[WorldState, AgentState]:
    """Update one mission after its command: the robot integrates its odometry, the referee checks."""
    stays = verdict != Code.RUNNING
    belief = predict(mind.belief, *executed.moved, executed.variances)
    belief = replace(belief, pose=climbed(belief.pose, command.rise, program.spec))
    pose = jax.tree.map(lambda new, old: jnp.where(stays, old, new), executed.pose, world.pose)
    acted = jnp.where(stays, 0.0, executed.time)
    time = world.time + settings.durations.measure + acted
    decisions = world.decisions + 1
    away = jnp.hypot(arena.goal_xy[0] - pose.x, arena.goal_xy[1] - pose.y)

    code = jnp.where(decisions >= settings.limits.max_decisions, Code.OUT_OF_STEPS, Code.RUNNING)
    code = jnp.where(stays, verdict, code)
    code = jnp.where(away <= settings.limits.goal_radius, Code.REACHED, code)
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
        planned=mind.planned,
    )
    if settings.metrics:
        step = Step(arena, world, after, command, ~stays, settings)
        after = replace(after, metrics=updated(settings.metrics, world.metrics, step))
    mind = carried_on(walked(mind, command, executed.moved, executed.variances), executed.moved, executed.variances)
    return after, replace(mind, belief=belief, since=settings.durations.measure + acted)
