"""The decision: localise, update the map, plan, select (paper, Fig. 2). One pure function of a batch of missions.

Rooms that are written for one arena are vmapped here. The planner takes the whole batch.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxbiped import mapping, planning
from jaxbiped.executors.world_state import Planned
from jaxbiped.geometry.pose import Pose
from jaxbiped.jax_settings import with_own_settings
from jaxbiped.mapping import Cell, GridSpec
from jaxbiped.mapping.fading import Eye
from jaxbiped.mission.foot_placement import place_feet
from jaxbiped.mission.goal import goal_cell
from jaxbiped.mission.localising import localise
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import MissionParams, MissionSpec
from jaxbiped.mission.route import pose_problem
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.state import AgentState
from jaxbiped.motion.local_map import LocalMap
from jaxbiped.motion.primitives import Command, Primitive
from jaxbiped.motion.selection import cell_of, select, stride
from jaxbiped.planning.planners import FINE, TOO_SLOW, Problem, Route
from jaxbiped.sensing.camera import MountedCamera, mount
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
    agent: AgentState,
    view: View,
    sightings: Sightings,
    setup: MissionSetup,
    active: Bool[Array, "B"] | None = None,
) -> tuple[AgentState, Command, Int[Array, "B"], DecisionTrace]:
    """The next action of each robot. All arguments have a leading batch axis.

    Of the arena, only what the robot has been told is read: landmarks and goal (paper, 2, conditions 2 and 3).

    Args:
      active: robots whose decision is used; by default all.

    Returns:
      The agent after the measurement, the command, the code with which the robot itself ends the mission (else
      RUNNING), and the decision trace.
    """
    params, spec = setup.params, setup.spec
    agent, local = perceive(agent, view, sightings, setup)
    blind = params.strategy.blind
    planned = replace(
        local,
        classes=jnp.where(blind[:, None, None], jnp.int8(Cell.FLOOR), local.classes),
        levels=jnp.where(blind[:, None, None], jnp.int8(0), local.levels),
    )
    rules = params.strategy.rules()
    goal_ij = jax.vmap(goal_cell, in_axes=(0, 0, 0, 0, None))(
        setup.arena.goal_xy, params.limits.goal_radius, planned.classes, rules, spec.grid
    )
    problem = pose_problem(planned, goal_ij, params, spec, active, agent.plan_state)
    route = params.planner.plan_batch(problem)
    agent = replace(agent, plan_state=route.state, planned=counted(agent.planned, route))
    agent, command, verdict = jax.vmap(choose)(agent, view, local, goal_ij, route.directions, setup)
    if route.fault is not None:
        code = jnp.where(route.fault == TOO_SLOW, Code.PLANNER_TIMEOUT, Code.PLANNER_FAILED)
        verdict = jnp.where(route.fault == FINE, verdict, code).astype(jnp.int32)
    evidence = agent.grid_map.evidence
    known = local.classes, local.levels, problem, route
    thought = DecisionTrace(*known, agent.belief.pose, view, evidence, sightings.seen)
    return agent, command, verdict, thought


def counted(planned: Planned, route: Route) -> Planned:
    """A mission's planning statistics, with one more route."""
    unknown = jnp.full_like(planned.seconds, jnp.nan)
    seconds = unknown if route.seconds is None else route.seconds
    cost = unknown if route.cost is None else route.cost
    first = jnp.isnan(planned.cost) & jnp.isfinite(cost)
    return Planned(planned.seconds + seconds, planned.calls + 1, jnp.where(first, cost, planned.cost))


def perceive(agent: AgentState, view: View, sightings: Sightings, setup: MissionSetup) -> tuple[AgentState, LocalMap]:
    """Update each robot with a measurement: its state, and the classed map with its place on it."""
    agent = jax.vmap(localise)(agent, view, sightings, setup)
    agent = begin_maps(agent, setup.params, setup.spec.grid)
    return jax.vmap(read_map, in_axes=(0, 0, 0, None))(agent, view, setup.params, setup.spec)


def begin_maps(agent: AgentState, params: MissionParams, grid: GridSpec) -> AgentState:
    """Give fresh agents a map of only the ground that their robot stands on.

    Few agents of a batch are fresh at once, and maps are large: only theirs are written.
    """
    pose = agent.belief.pose

    def begin(n, grid_map):
        k = fresh[n]
        first = mapping.mark_footprint(
            mapping.empty(grid), pose.x[k], pose.y[k], pose.z[k], params.limits.body_radius[k], grid
        )
        return jax.tree.map(lambda maps, new: maps.at[k].set(new), grid_map, first)

    fresh = jnp.argsort(~agent.fresh)  # their indices come first
    grid_map = jax.lax.fori_loop(0, jnp.sum(agent.fresh), begin, agent.grid_map)
    return replace(agent, grid_map=grid_map, fresh=jnp.zeros_like(agent.fresh))


def level_of(z: Float[Array, ""], grid: GridSpec) -> Int[Array, ""]:
    """The level [int8] of ground of height `z` [m]."""
    return jnp.round(z / grid.level_height).astype(jnp.int8)


def read_map(agent: AgentState, view: View, params: MissionParams, spec: MissionSpec) -> tuple[AgentState, LocalMap]:
    """Update one robot with one more view: its state, and the classed map with its place on it.

    Heights are counted level by level; the offset of its ground from a level was measured before it stepped there.
    """
    grid, pose = spec.grid, agent.belief.pose
    ij = cell_of(pose.x, pose.y, grid)
    tilted = not spec.knows_pose
    if tilted:
        pose = replace(pose, z=mapping.ground_height(agent.grid_map, ij, pose.z, grid))
        agent = replace(agent, belief=replace(agent.belief, pose=pose))
    eye = eye_of(agent, params, spec) if spec.fading else None
    grid_map = mapping.update(agent.grid_map, view, pose, params.body, params.mapping, grid, tilted, eye)
    classes, levels = mapping.classify(grid_map, params.mapping, grid)
    # The robot can stand where it stands, on its current level, whatever the map says.
    level = level_of(pose.z, grid)
    own = classes[ij[0], ij[1]]
    ground = jnp.where(level > 0, Cell.BUMP, Cell.FLOOR).astype(jnp.int8)
    classes = classes.at[ij[0], ij[1]].set(jnp.where(own == Cell.GATE, own, ground))
    levels = levels.at[ij[0], ij[1]].set(level)
    return replace(agent, grid_map=grid_map), LocalMap(classes, levels, ij, pose, grid)


def eye_of(agent: AgentState, params: MissionParams, spec: MissionSpec) -> Eye:
    """How a robot measures, and how much it keeps of older evidence that contradicts its new view."""
    at = mount(params.camera, agent.look, agent.squat)
    return Eye(MountedCamera(params.camera, at, spec.image), keep=jnp.exp(-agent.since / params.mapping.fade))


def choose(
    agent: AgentState,
    view: View,
    local: LocalMap,
    goal_ij: Int[Array, "2"],
    directions: Int[Array, "n"],
    setup: MissionSetup,
) -> tuple[AgentState, Command, Int[Array, ""]]:
    """The command of one robot, and whether it gives up.

    In the goal's cell there is nowhere to go: if the referee has not ended the mission by then, the robot is stuck.
    Without a path it turns on the spot and measures again, all around, before it gives up. The blind strategy
    stops at anything but floor.
    """
    params, spec, blind = setup.params, setup.spec, setup.params.strategy.blind
    classes, levels, ij = local.classes, local.levels, local.ij
    first = jnp.maximum(directions[: stride(spec.grid)], 0)
    command = select(local, first, agent.look)
    if spec.footing:
        agent, command = place_feet(agent, view, command, local, directions, setup)
    at_goal = jnp.all(ij == goal_ij)
    lost = (directions[0] < 0) & ~at_goal
    tries = jnp.where(lost, agent.tries + 1, 0)
    step = jnp.asarray(planning.DIRECTIONS)[jnp.maximum(directions[0], 0)]
    i, j = ij[0] + step[0], ij[1] + step[1]
    ahead, climb = classes[i, j], levels[i, j] - levels[ij[0], ij[1]]
    halted = blind & ~lost & (((ahead != Cell.FLOOR) & (ahead != Cell.UNMEASURED)) | (climb != 0))

    verdict = jnp.where(tries >= params.limits.max_looks, Code.NO_PATH, Code.RUNNING)
    verdict = jnp.where(at_goal | halted, Code.STUCK, verdict)
    still = lost | (verdict != Code.RUNNING)
    zero = jnp.zeros(())
    command = Command(
        turn=jnp.where(still, jnp.where(lost, LOOK_AROUND, zero), command.turn),
        primitive=jnp.where(still, Primitive.NONE, command.primitive),
        length=jnp.where(still, zero, command.length),
        rise=jnp.where(still, 0, command.rise),
        squat=jnp.where(still | (command.primitive == Primitive.LOOK), agent.squat, command.squat),
        left=jnp.where(still, zero, command.left),
    )
    look = command.primitive == Primitive.LOOK
    return replace(agent, squat=command.squat, look=look, tries=tries), command, verdict.astype(jnp.int32)


def climbed(pose: Pose, rise: Int[Array, ""], grid: GridSpec) -> Pose:
    """The believed pose after a step of `rise` levels."""
    return replace(pose, z=pose.z + rise * grid.level_height)
