"""From the classed map to the input of a planner, and to the first moves of its result."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxbiped import planning
from jaxbiped.geometry.pose import wrap_angle
from jaxbiped.mission.params import MissionParams, MissionSpec
from jaxbiped.motion.edge_approach import foresight
from jaxbiped.motion.local_map import LocalMap
from jaxbiped.motion.selection import stride
from jaxbiped.planning.edge_clearance import rim_costs
from jaxbiped.planning.planners import Problem


def pose_problem(
    local: LocalMap,
    goal_ij: Int[Array, "B 2"],
    params: MissionParams,
    spec: MissionSpec,
    active: Bool[Array, "B"] | None = None,
    state=None,
) -> Problem:
    """The planning problem of each robot.

    Robots whose feet are placed keep away from edges beside their path: see `planning.edge_clearance` for the cost.

    Args:
      local: [B]
      active: robots whose answer is used; by default all.
      state: of the planners.
    """
    grid, yaw = spec.grid, local.pose.yaw
    length = max(stride(grid), foresight(grid)) if spec.footing else stride(grid)
    return Problem(
        classes=local.classes,
        levels=local.levels,
        start_ij=local.ij,
        goal_ij=goal_ij,
        heading=jax.vmap(nearest_direction)(yaw),
        yaw=yaw,
        costs=params.costs.at_pitch(grid.pitch),
        rules=params.strategy.rules(),
        times=times_of(params),
        unit_seconds=seconds_of_a_unit(params),
        surcharge=rim_costs(local.classes, local.levels, grid.pitch) if spec.footing else None,
        active=jnp.ones(goal_ij.shape[0], bool) if active is None else active,
        state=state,
        pitch=grid.pitch,
        length=length,
    )


def nearest_direction(yaw: Float[Array, ""]) -> Int[Array, ""]:
    """Index into DIRECTIONS of the move closest to a yaw [rad]."""
    moves = jnp.asarray(planning.DIRECTIONS, jnp.float32)
    return jnp.argmin(jnp.abs(wrap_angle(jnp.arctan2(moves[:, 0], moves[:, 1]) - yaw))).astype(jnp.int32)


def seconds_of_a_unit(params: MissionParams) -> Float[Array, "*B"]:
    """Duration [s] of one unit of Eq. 1, from a straight move on the floor: 8 s for the paper's costs and times."""
    return params.durations.straight / (params.costs.c0 + params.costs.c1)


def times_of(params: MissionParams) -> planning.Times:
    """The durations of a mission's clock, and C4 in seconds."""
    d = params.durations
    return planning.Times(
        straight=d.straight,
        turn=d.turn,
        step_up=d.step_up,
        step_down=d.step_down,
        pass_gate=d.pass_gate,
        measure=d.measure,
        unmeasured=seconds_of_a_unit(params) * params.costs.c4,
    )
