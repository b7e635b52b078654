"""Follow plans on a known map: the time of a route when it is walked without measurements or errors."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float, Int

from jaxbiped.geometry.pose import Pose
from jaxbiped.mission.params import MissionParams, MissionSpec
from jaxbiped.mission.route import pose_problem
from jaxbiped.motion.local_map import LocalMap
from jaxbiped.motion.primitives import duration
from jaxbiped.motion.selection import cell_of, select


@partial(jax.jit, static_argnames=("spec", "most"))
def follow(
    begin: LocalMap, goal_ij: Int[Array, "B 2"], params: MissionParams, spec: MissionSpec, most: int = 100
) -> Float[Array, "B"]:
    """The time [s] at which each robot reaches its goal's cell; inf if it does not.

    Decision by decision as in a mission: plan, select, move nominally, count the durations and a measurement. The clock
    is the mission's, with real yaws and positions, so it shows how accurate the clock of a plan over headings is.

    Args:
      begin: [B] the true classes and levels, without unmeasured cells, and where each robot starts.
      params: one kind of mission, leaves without a batch axis.
      most: static; decisions after which a robot counts as not arrived.
    """
    grid, first = spec.grid, begin.pose

    def turn(state):
        x, y, yaw, time, _, count = state
        ij = jax.vmap(cell_of, in_axes=(0, 0, None))(x, y, grid)
        local = replace(begin, ij=ij, pose=Pose(x, y, jnp.zeros_like(x), yaw))
        directions = params.planner.plan_batch(pose_problem(local, goal_ij, params, spec)).directions
        command = jax.vmap(select, in_axes=(0, 0, None))(local, jnp.maximum(directions, 0), jnp.bool_(False))
        goes = jnp.any(ij != goal_ij, axis=1) & (directions[:, 0] >= 0)
        facing = yaw + command.turn
        moved = x + command.length * jnp.cos(facing), y + command.length * jnp.sin(facing), facing
        spent = duration(command, params.durations) + params.durations.measure
        x, y, yaw, time = (
            jnp.where(goes, new, old) for new, old in zip((*moved, time + spent), (x, y, yaw, time), strict=True)
        )
        return x, y, yaw, time, goes, count + 1

    state = first.x, first.y, first.yaw, jnp.zeros_like(first.x), jnp.ones(first.x.shape, bool), jnp.int32(0)
    x, y, _, time, _, _ = lax.while_loop(lambda s: jnp.any(s[4]) & (s[5] < most), turn, state)
    arrived = jnp.all(jax.vmap(cell_of, in_axes=(0, 0, None))(x, y, grid) == goal_ij, axis=1)
    return jnp.where(arrived, time, jnp.inf)
