"""How a mission ends."""

from __future__ import annotations

import enum


class Code(enum.IntEnum):
    """The code with which a mission ends. It prints as its label, and is a number in arrays."""

    RUNNING = -1
    REACHED = 0  # stands within 10 cm of the goal (paper, 3.1)
    NO_PATH = 1  # looked around, and the map has no path to the goal
    STUCK = 2  # the strategy stops here (blind_stop), or the robot wrongly believes that it has arrived
    COLLIDED = 3
    FELL = 4
    OUT_OF_BOUNDS = 5
    OUT_OF_STEPS = 6
    INVALID = 7  # NaN or overflow
    PLANNER_FAILED = 8  # the planner raised an error, or returned a path that its map forbids
    PLANNER_TIMEOUT = 9  # it exceeded its time limit

    @property
    def label(self) -> str:
        """The name used in tables."""
        return self.name.lower()

    def __str__(self) -> str:
        return self.label

    def __repr__(self) -> str:
        return f"<Code {self.label}>"

    def __format__(self, spec: str) -> str:
        return format(self.label, spec)
