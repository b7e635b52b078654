"""From the classed map to the input of a planner, and to the first moves of its result."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxbiped import planning
from jaxbiped.mission.settings import MissionParams, MissionSpec
from jaxbiped.motion.edge_approach import foresight
from jaxbiped.motion.selection import stride
from jaxbiped.planning.edge_clearance import rim_costs
from jaxbiped.planning.planners import Problem


def pose_problem(
    classes: Int[Array, "B H W"],
    levels: Int[Array, "B H W"],
    goal_ij: Int[Array, "B 2"],
    ij: Int[Array, "B 2"],
    heading: Int[Array, "B"],
    yaw: Float[Array, "B"],
    settings: MissionParams,
    program: MissionSpec,
    active: Bool[Array, "B"] | None = None,
    state=None,
) -> Problem:
    """The planning problem of each robot.

    Robots whose feet are placed keep away from edges beside their path: see `planning.edge_clearance` for the cost.

    Args:
      heading: the direction nearest to `yaw` [rad].
      active: robots whose answer is used; by default all.
      state: of the planners.
    """
    spec = program.spec
    length = max(stride(spec), foresight(spec)) if program.footing else stride(spec)
    return Problem(
        classes=classes,
        levels=levels,
        start_ij=ij,
        goal_ij=goal_ij,
        heading=heading,
        yaw=yaw,
        costs=settings.costs.at_pitch(spec.pitch),
        rules=settings.strategy.rules(),
        times=times_of(settings),
        unit_seconds=seconds_of_a_unit(settings),
        surcharge=rim_costs(classes, levels, spec.pitch) if program.footing else None,
        active=jnp.ones(ij.shape[0], bool) if active is None else active,
        state=state,
        pitch=spec.pitch,
        length=length,
    )


def seconds_of_a_unit(settings: MissionParams) -> Float[Array, "*B"]:
    """Duration [s] of one unit of Eq. 1, from a straight move on the floor: 8 s for the paper's costs and times."""
    return settings.durations.straight / (settings.costs.c0 + settings.costs.c1)


def times_of(settings: MissionParams) -> planning.Times:
    """The durations of a mission's clock, and C4 in seconds."""
    d = settings.durations
    return planning.Times(
        straight=d.straight,
        turn=d.turn,
        step_up=d.step_up,
        step_down=d.step_down,
        pass_gate=d.pass_gate,
        measure=d.measure,
        unmeasured=seconds_of_a_unit(settings) * settings.costs.c4,
    )
