"""Follow plans on a known map: the time of a route when it is walked without measurements or errors."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float, Int

from jaxbiped.geometry.pose import Pose
from jaxbiped.mission.decision import nearest_direction
from jaxbiped.mission.route import pose_problem
from jaxbiped.mission.settings import MissionParams, MissionSpec
from jaxbiped.motion.primitives import duration
from jaxbiped.motion.selection import cell_of, select


@partial(jax.jit, static_argnames=("program", "most"))
def follow(
    classes: Int[Array, "B H W"],
    levels: Int[Array, "B H W"],
    start_xyyaw: Float[Array, "B 3"],
    goal_ij: Int[Array, "B 2"],
    settings: MissionParams,
    program: MissionSpec,
    most: int = 100,
) -> Float[Array, "B"]:
    """The time [s] at which each robot reaches its goal's cell; inf if it does not.

    Decision by decision as in a mission: plan, select, move nominally, count the durations and a measurement. The clock
    is the mission's, with real yaws and positions, so it shows how accurate the clock of a plan over headings is.

    Args:
      classes: the true ones, without unmeasured cells.
      settings: one kind of mission, leaves without a batch axis.
      most: static; decisions after which a robot counts as not arrived.
    """
    spec = program.spec

    def turn(state):
        x, y, yaw, time, _, count = state
        ij = jax.vmap(cell_of, in_axes=(0, 0, None))(x, y, spec)
        heading = jax.vmap(nearest_direction)(yaw)
        problem = pose_problem(classes, levels, goal_ij, ij, heading, yaw, settings, program)
        directions = settings.planner.plan_batch(problem).directions
        command = jax.vmap(select, in_axes=(0, 0, 0, 0, 0, None, None))(
            Pose(x, y, jnp.zeros_like(x), yaw), ij, jnp.maximum(directions, 0), classes, levels, jnp.bool_(False), spec
        )
        goes = jnp.any(ij != goal_ij, axis=1) & (directions[:, 0] >= 0)
        facing = yaw + command.turn
        moved = x + command.length * jnp.cos(facing), y + command.length * jnp.sin(facing), facing
        spent = duration(command, settings.durations) + settings.durations.measure
        x, y, yaw, time = (
            jnp.where(goes, new, old) for new, old in zip((*moved, time + spent), (x, y, yaw, time), strict=True)
        )
        return x, y, yaw, time, goes, count + 1

    first = *start_xyyaw.T, jnp.zeros(len(classes)), jnp.ones(len(classes), bool), jnp.int32(0)
    x, y, _, time, _, _ = lax.while_loop(lambda s: jnp.any(s[4]) & (s[5] < most), turn, first)
    arrived = jnp.all(jax.vmap(cell_of, in_axes=(0, 0, None))(x, y, spec) == goal_ij, axis=1)
    return jnp.where(arrived, time, jnp.inf)
