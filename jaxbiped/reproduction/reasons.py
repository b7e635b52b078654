"""Why our figures differ from the paper's: sentences derived from the mission's own log."""

from __future__ import annotations

from jaxbiped.motion.grid_units import CELL
from jaxbiped.report.words import signed
from jaxbiped.reproduction.account import (
    ASIDE,
    DIAGONAL,
    DOWN,
    GATE,
    GATE_CARRIES,
    STRAIGHT,
    TURN,
    UP,
    Record,
    other_reading,
)
from jaxbiped.reproduction.paper import Experiment, expected

WORTH = 0.10  # relative difference in time above which it is explained
FAR = 0.10  # [m] the same for a distance
LEAST = 12.0  # [s] shortest part that is named


def relative(ours: float, paper: float) -> float:
    """The difference relative to the paper's value."""
    return (ours - paper) / paper


def time_reason(item: Experiment, record: Record, measure: float, gate_depth: float, radius: float) -> str | None:
    """Why the time of a mission differs by more than `WORTH`; None if it does not, or is not published.

    The time by Table 2 alone for the paper's path is compared to both: the paper's excess over it, and ours.

    Args:
      measure: [s] duration of a measurement.
      gate_depth: [m] depth of the lintel along the path; 0 if there is none.
      radius: [m] by which obstacles are grown.
    """
    if not item.minutes or not record.reached or item.way is None:
        return None
    ours, paper, table = record.time(measure), 60 * item.minutes, expected(item, measure)
    if abs(relative(ours, paper)) <= WORTH:
        return None
    unexplained, excess = paper - table.total, ours - table.total
    named = sorted(parts_beyond(item, record, measure), key=lambda part: -abs(part[0]))
    said = [f"{signed(seconds / 60, 1)} min {what}" for seconds, what in named if abs(seconds) >= LEAST]
    text = (
        f"Experiment {item.number}: {minutes(ours)} min is {minutes(abs(ours - paper))} min "
        f"{'more' if ours > paper else 'less'} than the paper's {item.minutes:.1f}. Table 2, with a measurement of "
        f"{measure:.1f} s in each cell, gives {minutes(table.total)} min for the {'' if item.distance else 'straight '}"
        f"{100 * item.way:.0f} cm of the paper. The paper's own time is {beyond(unexplained)} that, ours "
        f"{beyond(excess)} it: {', '.join(said) or 'no part of it by more than 0.2 min'}."
    )
    if record.parts[GATE].count and gate_depth and named[0][1].startswith("in the gate"):
        text += (
            f" The lintel is {100 * gate_depth:.0f} cm deep; grown by the robot's radius of {100 * radius:.1f} cm on "
            f"both sides, it makes a gate of {100 * (gate_depth + 2 * radius):.0f} cm, each cell of which takes "
            f"three times as long as one of floor. If the 48 s of Table 2 were for {100 * GATE_CARRIES:.0f} cm, ours "
            f"would take {minutes(other_reading(record).time(measure))} min."
        )
    if abs(unexplained) > abs(excess):
        text += " So most of the difference is time that the paper's own Table 2 does not account for."
    return text


def parts_beyond(item: Experiment, record: Record, measure: float) -> list[tuple[float, str]]:
    """Time of each kind of action beyond that of Table 2: [s], and its name."""
    table, parts = expected(item, measure), record.parts
    floor, edges = parts[STRAIGHT] + parts[DIAGONAL], parts[UP] + parts[DOWN]
    walked = f"{100 * floor.metres:.0f} cm, {parts[DIAGONAL].count} of {floor.count} moves diagonal"
    return [
        (floor.seconds - table.straight, f"walking on floor and bumps ({walked})"),
        (edges.seconds - table.edges, f"over edges ({edges.count}, of 10 cm each)"),
        (parts[GATE].seconds - table.gate, f"in the gate ({parts[GATE].metres / CELL:.1f} cells instead of one)"),
        (parts[TURN].seconds, f"turning ({parts[TURN].count} turns)"),
        (parts[ASIDE].seconds, f"to the side or backward ({parts[ASIDE].count} times)"),
        (
            record.measurements * measure - table.measuring,
            f"measuring ({record.measurements} times instead of {table.cells:.0f})",
        ),
    ]


def distance_reason(item: Experiment, record: Record, shortest: float | None) -> str | None:
    """Why the distance of a mission differs by more than `FAR`; None if it does not, or none is published.

    Args:
      shortest: [m] length of the path preferred by Eq. (1) with perfect knowledge of our scene.
    """
    paper = item.way
    if paper is None or not record.reached or abs(record.distance - paper) <= FAR:
        return None
    text = (
        f"Experiment {item.number}: {100 * record.distance:.0f} cm is {100 * abs(record.distance - paper):.0f} cm "
        f"{'more' if record.distance > paper else 'less'} than the paper's {100 * paper:.0f}."
    )
    if shortest is None:
        return text
    aside = record.parts[ASIDE].metres
    return text + (
        f" With perfect knowledge of the scene, the path preferred by Eq. (1) is {100 * shortest:.0f} cm: "
        f"{signed(100 * (shortest - paper), 0)} cm of the difference is due to our layout, which the paper leaves "
        f"open, and {signed(100 * (record.distance - shortest), 0)} cm arose on the way"
        + (f", {100 * aside:.0f} cm of it to the side or backward." if aside >= 0.005 else ".")
    )


def minutes(seconds: float) -> str:
    """Minutes with one decimal."""
    return f"{seconds / 60:.1f}"


def beyond(seconds: float) -> str:
    """As in "1.2 min above"."""
    return f"{minutes(abs(seconds))} min {'above' if seconds >= 0 else 'below'}"
