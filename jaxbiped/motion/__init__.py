"""What the robot plays: its primitives, and which one comes next (paper, 2.4)."""

from jaxbiped.motion.edge import crossing_direction
from jaxbiped.motion.primitives import Command, DurationConfig, Durations, Primitive, duration
from jaxbiped.motion.robot import RobotConfig
from jaxbiped.motion.selection import cell_of, select, stride

__all__ = [
    "Command",
    "DurationConfig",
    "Durations",
    "Primitive",
    "RobotConfig",
    "cell_of",
    "crossing_direction",
    "duration",
    "select",
    "stride",
]
