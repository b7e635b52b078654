"""How a mission ends."""

from __future__ import annotations

import enum


class Code(enum.IntEnum):
    """The one code that each mission ends with. It prints as its label, and is a number in arrays."""

    RUNNING = -1
    REACHED = 0  # stands within 10 cm of the goal (paper, 3.1)
    NO_PATH = 1  # looked around, and no path to the goal is left on the map
    STUCK = 2  # the strategy stops here (blind_stop), or the robot believes to be there and is not
    COLLIDED = 3
    FELL = 4
    OUT_OF_BOUNDS = 5
    OUT_OF_STEPS = 6
    INVALID = 7  # NaN or overflow
    PLANNER_FAILED = 8  # the planner raised an error, or gave a way that its map forbids
    PLANNER_TIMEOUT = 9  # it took longer than it may

    @property
    def label(self) -> str:
        """As in tables."""
        return self.name.lower()

    def __str__(self) -> str:
        return self.label

    def __repr__(self) -> str:
        return f"<Code {self.label}>"

    def __format__(self, spec: str) -> str:
        return format(self.label, spec)
