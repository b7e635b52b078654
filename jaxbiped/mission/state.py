"""The state of a mission: the true world, and the robot's beliefs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, UInt32

from jaxbiped.arenas.ground import ground_height
from jaxbiped.executors.world_state import Planned, WorldState
from jaxbiped.geometry.pose import Pose
from jaxbiped.jax_settings import with_own_settings
from jaxbiped.localisation.kalman_filter import Belief
from jaxbiped.localisation.scan_match import Outlines, no_outlines
from jaxbiped.mapping import GridMap, empty
from jaxbiped.mission.metric import begun
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import ICP, VISUAL
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.sensing.edges import Edge, unknown


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Anchor:
    """The last view, from which a robot without landmarks measures its motion."""

    belief: Belief  # belief after that view
    look: Bool[Array, "*B"]  # whether the camera looked down
    squat: Bool[Array, "*B"]
    moved: Float[Array, "*B 3"]  # dx, dy [m], dyaw [rad] since then, by odometry
    variances: Float[Array, "*B 3"]  # variances of `moved`
    some: Bool[Array, "*B"]  # False before the first view


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class AgentState:
    """The robot's side. The stance is known to both."""

    belief: Belief  # pose and its covariance; pose.z is the height of the ground under the robot
    grid_map: GridMap
    squat: Bool[Array, "*B"]
    look: Bool[Array, "*B"]  # the next measurement looks down in front of the feet
    tries: Int[Array, "*B"]  # successive measurements without a path
    fresh: Bool[Array, "*B"]  # nothing measured yet: the map's content is from another mission
    ahead: Edge  # ground edge that the robot is about to cross; only with foot placement
    behind: Edge  # the edge crossed last
    since: Float[Array, "*B"]  # [s] from the last measurement to the next
    planned: Planned
    plan_state: Any = None  # state of its planner
    anchor: Anchor | None = None  # only if its motion is measured
    outlines: Outlines | None = None  # wall outlines; only if it localises by them


@with_own_settings
def start(setup: MissionSetup, seed: UInt32[Array, ""]) -> tuple[WorldState, AgentState]:
    """One mission before its first measurement. The robot knows its initial pose (paper, 2, condition 2)."""
    arena, params, grid, localisation = setup.arena, setup.params, setup.spec.grid, setup.spec.localisation
    x, y, yaw = arena.start_xyyaw
    pose = Pose(x, y, ground_height(arena, x, y), yaw)
    away = jnp.hypot(arena.goal_xy[0] - x, arena.goal_xy[1] - y)
    no, zero = jnp.zeros((), bool), jnp.zeros((), jnp.int32)
    code = jnp.where(away <= params.limits.goal_radius, Code.REACHED, Code.RUNNING).astype(jnp.int32)
    code = jnp.where(jnp.isfinite(away) & jnp.isfinite(yaw), code, Code.INVALID)
    visual = localisation in VISUAL
    none = jnp.zeros(())
    planned = Planned(none, zero, jnp.full_like(none, jnp.nan))
    metrics = begun(params.metrics, arena, params)
    world = WorldState(
        pose, no, none, none, zero, zero, code, seed, none, none, planned, pose if visual else None, metrics
    )
    belief = Belief(pose, jnp.diag(params.limits.start_variance))
    outlines = no_outlines(grid) if localisation in ICP else None
    anchor = Anchor(belief, no, no, jnp.zeros(3), jnp.zeros(3), no) if visual else None
    return world, AgentState(
        belief=belief,
        grid_map=empty(grid),
        squat=no,
        look=no,
        tries=zero,
        fresh=~no,
        ahead=unknown(),
        behind=unknown(),
        since=none,
        planned=planned,
        plan_state=params.planner.initial_state(grid.shape),
        anchor=anchor,
        outlines=outlines,
    )
