"""What the robot plays: its primitives, and the selection of the next one (paper, 2.4)."""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(
    __name__,
    {
        "config": "DurationConfig RobotConfig",
        "edge": "crossing_direction",
        "primitives": "Command Durations Primitive duration",
        "selection": "cell_of select stride",
    },
)
