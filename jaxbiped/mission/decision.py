"""The decision: localise, update the map, plan, select (paper, Fig. 2). One pure function of a batch of missions.

Rooms that are written for one arena are vmapped here. The planner takes the whole batch.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxbiped import mapping, planning
from jaxbiped.arenas.arena import Arena
from jaxbiped.geometry.pose import Pose, wrap_angle
from jaxbiped.jax_settings import with_own_settings
from jaxbiped.mapping import Cell, GridSpec
from jaxbiped.mapping.fading import Eye
from jaxbiped.mission.foot_placement import place_feet
from jaxbiped.mission.goal import goal_cell
from jaxbiped.mission.localising import localise
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.route import pose_problem
from jaxbiped.mission.settings import MissionParams, MissionSpec
from jaxbiped.mission.state import AgentState, Planned
from jaxbiped.motion.primitives import Command, Primitive
from jaxbiped.motion.selection import cell_of, select, stride
from jaxbiped.planning.planners import FINE, TOO_SLOW, Problem, Route
from jaxbiped.sensing.camera import mount
from jaxbiped.sensing.view import Sightings, View

LOOK_AROUND = jnp.pi / 2  # [rad] turn between measurements when no path is known


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class DecisionTrace:
    """The basis of a command; for logs and pictures."""

    classes: Int[Array, "B H W"]
    levels: Int[Array, "B H W"]
    problem: Problem  # [B] input of the planner
    route: Route  # [B] output of the planner
    pose: Pose  # [B] as believed
    view: View  # [B N] what was measured
    evidence: Float[Array, "B H W Z"]  # of the 3D grid, including that view
    landmarks: Bool[Array, "B L"]  # landmarks seen


@with_own_settings
def decide(
    mind: AgentState,
    view: View,
    sightings: Sightings,
    arena: Arena,
    settings: MissionParams,
    program: MissionSpec,
    active: Bool[Array, "B"] | None = None,
) -> tuple[AgentState, Command, Int[Array, "B"], DecisionTrace]:
    """The next action of each robot. All arguments have a leading batch axis.

    Of the arena, only what the robot has been told is read: landmarks and goal (paper, 2, conditions 2 and 3).

    Args:
      active: robots whose decision is used; by default all.

    Returns:
      The mind after the measurement, the command, the code with which the robot itself ends the mission (else
      RUNNING), and the decision trace.
    """
    mind, classes, levels, ij = perceive(mind, view, sightings, arena, settings, program)
    spec = program.spec
    blind = settings.strategy.blind
    plan_classes = jnp.where(blind[:, None, None], jnp.int8(Cell.FLOOR), classes)
    plan_levels = jnp.where(blind[:, None, None], jnp.int8(0), levels)
    rules = settings.strategy.rules()
    goal_ij = jax.vmap(goal_cell, in_axes=(0, 0, 0, 0, None))(
        arena.goal_xy, settings.limits.goal_radius, plan_classes, rules, spec
    )
    heading = jax.vmap(nearest_direction)(mind.belief.pose.yaw)
    yaw = mind.belief.pose.yaw
    problem = pose_problem(
        plan_classes, plan_levels, goal_ij, ij, heading, yaw, settings, program, active, mind.plan_state
    )
    route = settings.planner.plan_batch(problem)
    mind = replace(mind, plan_state=route.state, planned=counted(mind.planned, route))
    mind, command, verdict = jax.vmap(choose, in_axes=(0, 0, 0, 0, 0, 0, 0, 0, 0, None))(
        mind, view, ij, goal_ij, route.directions, classes, levels, blind, settings, program
    )
    if route.fault is not None:
        code = jnp.where(route.fault == TOO_SLOW, Code.PLANNER_TIMEOUT, Code.PLANNER_FAILED)
        verdict = jnp.where(route.fault == FINE, verdict, code).astype(jnp.int32)
    evidence = mind.grid_map.evidence
    thought = DecisionTrace(classes, levels, problem, route, mind.belief.pose, view, evidence, sightings.seen)
    return mind, command, verdict, thought


def counted(planned: Planned, route: Route) -> Planned:
    """A mission's planning statistics, with one more route."""
    unknown = jnp.full_like(planned.seconds, jnp.nan)
    seconds = unknown if route.seconds is None else route.seconds
    cost = unknown if route.cost is None else route.cost
    first = jnp.isnan(planned.cost) & jnp.isfinite(cost)
    return Planned(planned.seconds + seconds, planned.calls + 1, jnp.where(first, cost, planned.cost))


def perceive(
    mind: AgentState, view: View, sightings: Sightings, arena: Arena, settings: MissionParams, program: MissionSpec
) -> tuple[AgentState, Int[Array, "B H W"], Int[Array, "B H W"], Int[Array, "B 2"]]:
    """Update each robot with a measurement: its mind, the classed map, and its cell."""
    mind = jax.vmap(localise, in_axes=(0, 0, 0, 0, 0, None))(mind, view, sightings, arena.landmarks, settings, program)
    mind = begin_maps(mind, settings, program.spec)
    return jax.vmap(read_map, in_axes=(0, 0, 0, None))(mind, view, settings, program)


def begin_maps(mind: AgentState, settings: MissionParams, spec: GridSpec) -> AgentState:
    """Give fresh minds a map of only the ground that their robot stands on.

    Few minds of a batch are fresh at once, and maps are large: only theirs are written.
    """
    pose = mind.belief.pose

    def begin(n, grid_map):
        k = fresh[n]
        first = mapping.mark_footprint(
            mapping.empty(spec), pose.x[k], pose.y[k], pose.z[k], settings.limits.body_radius[k], spec
        )
        return jax.tree.map(lambda maps, new: maps.at[k].set(new), grid_map, first)

    fresh = jnp.argsort(~mind.fresh)  # their indices come first
    grid_map = jax.lax.fori_loop(0, jnp.sum(mind.fresh), begin, mind.grid_map)
    return replace(mind, grid_map=grid_map, fresh=jnp.zeros_like(mind.fresh))


def level_of(z: Float[Array, ""], spec: GridSpec) -> Int[Array, ""]:
    """The level [int8] of ground of height `z` [m]."""
    return jnp.round(z / spec.level_height).astype(jnp.int8)


def read_map(
    mind: AgentState, view: View, settings: MissionParams, program: MissionSpec
) -> tuple[AgentState, Int[Array, "H W"], Int[Array, "H W"], Int[Array, "2"]]:
    """Update one robot with one more view: its mind, the classed map, and its cell.

    Heights are counted level by level; the offset of its ground from a level was measured before it stepped there.
    """
    spec, pose = program.spec, mind.belief.pose
    ij = cell_of(pose.x, pose.y, spec)
    tilted = not program.knows_pose
    if tilted:
        pose = replace(pose, z=mapping.ground_height(mind.grid_map, ij, pose.z, spec))
        mind = replace(mind, belief=replace(mind.belief, pose=pose))
    eye = eye_of(mind, settings, program) if program.fading else None
    grid_map = mapping.update(mind.grid_map, view, pose, settings.body, settings.mapping, spec, tilted, eye)
    classes, levels = mapping.classify(grid_map, settings.mapping, spec)
    # The robot can stand where it stands, on its current level, whatever the map says.
    level = level_of(pose.z, spec)
    own = classes[ij[0], ij[1]]
    ground = jnp.where(level > 0, Cell.BUMP, Cell.FLOOR).astype(jnp.int8)
    classes = classes.at[ij[0], ij[1]].set(jnp.where(own == Cell.GATE, own, ground))
    levels = levels.at[ij[0], ij[1]].set(level)
    return replace(mind, grid_map=grid_map), classes, levels, ij


def eye_of(mind: AgentState, settings: MissionParams, program: MissionSpec) -> Eye:
    """How a robot measures, and how much it keeps of older evidence that contradicts its new view."""
    at = mount(settings.camera, mind.look, mind.squat)
    return Eye(settings.camera, at, program.image, keep=jnp.exp(-mind.since / settings.mapping.fade))


def choose(
    mind: AgentState,
    view: View,
    ij: Int[Array, "2"],
    goal_ij: Int[Array, "2"],
    directions: Int[Array, "n"],
    classes: Int[Array, "H W"],
    levels: Int[Array, "H W"],
    blind: Bool[Array, ""],
    settings: MissionParams,
    program: MissionSpec,
) -> tuple[AgentState, Command, Int[Array, ""]]:
    """The command of one robot, and whether it gives up.

    In the goal's cell there is nowhere to go: if the referee has not ended the mission by then, the robot is stuck.
    Without a path it turns on the spot and measures again, all around, before it gives up. The blind strategy
    stops at anything but floor.
    """
    spec = program.spec
    first = jnp.maximum(directions[: stride(spec)], 0)
    command = select(mind.belief.pose, ij, first, classes, levels, mind.look, spec)
    if program.footing:
        mind, command = place_feet(mind, view, command, ij, directions, classes, levels, settings, program)
    at_goal = jnp.all(ij == goal_ij)
    lost = (directions[0] < 0) & ~at_goal
    tries = jnp.where(lost, mind.tries + 1, 0)
    step = jnp.asarray(planning.DIRECTIONS)[jnp.maximum(directions[0], 0)]
    i, j = ij[0] + step[0], ij[1] + step[1]
    ahead, climb = classes[i, j], levels[i, j] - levels[ij[0], ij[1]]
    halted = blind & ~lost & (((ahead != Cell.FLOOR) & (ahead != Cell.UNMEASURED)) | (climb != 0))

    verdict = jnp.where(tries >= settings.limits.max_looks, Code.NO_PATH, Code.RUNNING)
    verdict = jnp.where(at_goal | halted, Code.STUCK, verdict)
    still = lost | (verdict != Code.RUNNING)
    zero = jnp.zeros(())
    command = Command(
        turn=jnp.where(still, jnp.where(lost, LOOK_AROUND, zero), command.turn),
        primitive=jnp.where(still, Primitive.NONE, command.primitive),
        length=jnp.where(still, zero, command.length),
        rise=jnp.where(still, 0, command.rise),
        squat=jnp.where(still | (command.primitive == Primitive.LOOK), mind.squat, command.squat),
        left=jnp.where(still, zero, command.left),
    )
    look = command.primitive == Primitive.LOOK
    return replace(mind, squat=command.squat, look=look, tries=tries), command, verdict.astype(jnp.int32)


def nearest_direction(yaw: Float[Array, ""]) -> Int[Array, ""]:
    """Index into DIRECTIONS of the move closest to a yaw [rad]."""
    moves = jnp.asarray(planning.DIRECTIONS, jnp.float32)
    return jnp.argmin(jnp.abs(wrap_angle(jnp.arctan2(moves[:, 0], moves[:, 1]) - yaw))).astype(jnp.int32)


def climbed(pose: Pose, rise: Int[Array, ""], spec: GridSpec) -> Pose:
    """The believed pose after a step of `rise` levels."""
    return replace(pose, z=pose.z + rise * spec.level_height)
