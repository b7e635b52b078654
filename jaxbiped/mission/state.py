"""What is true of a mission at a moment, and what the robot makes of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, UInt32

from jaxbiped.arenas.arena import Arena
from jaxbiped.arenas.ground import ground_height
from jaxbiped.geometry.pose import Pose
from jaxbiped.jax_settings import with_own_settings
from jaxbiped.localisation.kalman_filter import Belief
from jaxbiped.localisation.scan_match import Outlines, no_outlines
from jaxbiped.mapping import GridMap, GridSpec, empty
from jaxbiped.mission.metric import begun
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.settings import ICP, VISUAL, MissionParams
from jaxbiped.sensing.edges import Edge, unknown


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Planned:
    """What is told of a mission's planning."""

    seconds: Float[Array, "*B"]  # [s] that it took; NaN where that is not known
    calls: Int[Array, "*B"]
    cost: Float[Array, "*B"]  # by Eq. 1, of the first way that was found; NaN where that is not known


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class WorldState:
    """The referee's side: only sensors and executors read it, the robot never does."""

    pose: Pose  # where the robot stands
    squat: Bool[Array, "*B"]  # its stance
    distance: Float[Array, "*B"]  # [m] walked
    time: Float[Array, "*B"]  # [s]
    measurements: Int[Array, "*B"]
    decisions: Int[Array, "*B"]
    code: Int[Array, "*B"]  # Code
    seed: UInt32[Array, "*B"]  # of all noise of this mission
    pose_error: Float[Array, "*B"]  # [m] from where the robot believes to stand
    yaw_error: Float[Array, "*B"]  # [rad] the same of its yaw, without sign
    planned: Planned
    before: Pose | None = None  # where it stood one command earlier; only where its motion is measured
    metrics: tuple = ()  # what each metric of the settings remembers


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class BodyPose:
    """How a robot really holds its body: the robot frame that its cameras are fixed to.

    In the home posture it is the frame of the feet; else it is that frame moved and tilted as the torso is.
    """

    pose: Pose  # its origin and yaw
    roll: Float[Array, "*B"]  # [rad] to the right
    pitch: Float[Array, "*B"]  # [rad] forward and down


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Anchor:
    """What a robot that goes by what it sees, and not by landmarks, measures its motion from: its last view."""

    belief: Belief  # after it
    look: Bool[Array, "*B"]  # how the camera was held
    squat: Bool[Array, "*B"]
    moved: Float[Array, "*B 3"]  # dx, dy [m], dyaw [rad] since, by odometry
    variances: Float[Array, "*B 3"]  # of that
    some: Bool[Array, "*B"]  # False before the first view


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class AgentState:
    """The robot's side. The stance is known to both."""

    belief: Belief  # pose and its covariance; pose.z is the height of the ground that it stands on
    grid_map: GridMap
    squat: Bool[Array, "*B"]
    look: Bool[Array, "*B"]  # the next measurement looks down before the feet
    tries: Int[Array, "*B"]  # measurements in a row that showed no path
    fresh: Bool[Array, "*B"]  # nothing measured yet: whatever the map holds is of no mission of this robot
    ahead: Edge  # of the ground, that the robot is about to cross; only where footing counts
    behind: Edge  # that it crossed last
    since: Float[Array, "*B"]  # [s] from the last measurement to the next
    planned: Planned
    plan_state: Any = None  # of its planner
    anchor: Anchor | None = None  # only where its motion is measured
    outlines: Outlines | None = None  # of walls; only where it localises by these


@with_own_settings
def start(
    arena: Arena, settings: MissionParams, seed: UInt32[Array, ""], spec: GridSpec, localisation: str = "landmarks"
) -> tuple[WorldState, AgentState]:
    """One mission before its first measurement. The robot knows where it starts (paper, 2, condition 2)."""
    x, y, yaw = arena.start_xyyaw
    pose = Pose(x, y, ground_height(arena, x, y), yaw)
    away = jnp.hypot(arena.goal_xy[0] - x, arena.goal_xy[1] - y)
    no, zero = jnp.zeros((), bool), jnp.zeros((), jnp.int32)
    code = jnp.where(away <= settings.limits.goal_radius, Code.REACHED, Code.RUNNING).astype(jnp.int32)
    code = jnp.where(jnp.isfinite(away) & jnp.isfinite(yaw), code, Code.INVALID)
    visual = localisation in VISUAL
    none = jnp.zeros(())
    planned = Planned(none, zero, jnp.full_like(none, jnp.nan))
    metrics = begun(settings.metrics, arena, settings)
    world = WorldState(
        pose, no, none, none, zero, zero, code, seed, none, none, planned, pose if visual else None, metrics
    )
    belief = Belief(pose, jnp.diag(settings.limits.start_variance))
    outlines = no_outlines(spec) if localisation in ICP else None
    anchor = Anchor(belief, no, no, jnp.zeros(3), jnp.zeros(3), no) if visual else None
    return world, AgentState(
        belief=belief,
        grid_map=empty(spec),
        squat=no,
        look=no,
        tries=zero,
        fresh=~no,
        ahead=unknown(),
        behind=unknown(),
        since=none,
        planned=planned,
        plan_state=settings.planner.initial_state(spec.shape),
        anchor=anchor,
        outlines=outlines,
    )
