"""From the classed map to the first moves of a plan: by the costs of Eq. 1 over cells, or by time over headings."""

from __future__ import annotations

from jaxtyping import Array, Float, Int, Int8

from jaxbiped import planning
from jaxbiped.mission.settings import Program, Settings
from jaxbiped.motion.approach import foresight
from jaxbiped.motion.selection import stride
from jaxbiped.planning.rims import rim_costs


def route(
    classes: Int[Array, "B H W"],
    levels: Int[Array, "B H W"],
    goal_ij: Int[Array, "B 2"],
    ij: Int[Array, "B 2"],
    heading: Int[Array, "B"],
    yaw: Float[Array, "B"],
    settings: Settings,
    program: Program,
) -> tuple[Float[Array, "B H W"], Int8[Array, "B n"]]:
    """What is left from each cell to the goal, and the first moves from the robot's own; -1 where there is none.

    What is left is a cost of Eq. 1, or the time [s] from the best heading with the planner `heading`. Robots whose feet
    are placed keep off edges beside their way (`planning.rims`).

    Args:
      heading: the direction nearest to `yaw` [rad].
    """
    costs, rules, pitch = settings.costs.at_pitch(program.spec.pitch), settings.strategy.rules(), program.spec.pitch
    length = max(stride(program.spec), foresight(program.spec)) if program.footing else stride(program.spec)
    if program.planner == "heading":
        field = quickest(classes, levels, goal_ij, settings, program)
        return field.cost.min(1), planning.heading_path(field, ij, yaw, length).directions
    if program.footing:
        moves = planning.edge_costs(classes, levels, costs, rules)
        moves = moves + rim_costs(classes, levels, pitch)
        to_go = planning.cost_to_go(moves, goal_ij)
        return to_go.cost, planning.read_path(to_go, moves, ij, length, heading).directions
    to_go = planning.field(classes, levels, costs, rules, goal_ij)
    return to_go.cost, planning.next_step(to_go.cost, classes, levels, costs, rules, ij, heading, length=length)


def quickest(
    classes: Int[Array, "B H W"],
    levels: Int[Array, "B H W"],
    goal_ij: Int[Array, "B 2"],
    settings: Settings,
    program: Program,
) -> planning.HeadingField:
    """The field of the planner `heading`: times of the mission's own clock."""
    extra = None
    if program.footing:
        unit = seconds_of_a_unit(settings).reshape(-1, 1, 1, 1)  # of each robot, or of all
        extra = unit * rim_costs(classes, levels, program.spec.pitch)
    return planning.heading_field(
        classes, levels, times_of(settings), settings.strategy.rules(), goal_ij, program.spec.pitch, extra
    )


def seconds_of_a_unit(settings: Settings) -> Float[Array, "*B"]:
    """What a unit of Eq. 1 stands for [s], by a straight move on the floor: 8 s for the paper's costs and times."""
    return settings.durations.straight / (settings.costs.c0 + settings.costs.c1)


def times_of(settings: Settings) -> planning.Times:
    """The durations of a mission's clock, and what C4 stands for in seconds."""
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
