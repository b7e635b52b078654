"""Options of `jaxbiped tune`."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar, Literal

from jaxbiped.commands.options.base import CameraFileOptions, RobotFileOptions
from jaxbiped.commands.options.strategies import strategy_notes
from jaxbiped.core.names import STRATEGIES
from jaxbiped.study.tuning_config import TuneConfig


class TuneArgs(RobotFileOptions, CameraFileOptions, TuneConfig):
    """Tune the costs C1 to C4 on random arenas, and evaluate them on others.

    C0 stays fixed, since the planner takes the same paths if all costs double. A TOML file may come first and give the
    defaults.
    """

    BASIC: ClassVar[tuple[str, ...]] = (
        *("seed", "arenas", "test_arenas", "families", "strategy", "from_durations"),
        *("mission.sensor", "mission.preset", "mission.executor"),
        *("robot_file", "camera_file", "out"),
    )
    NOTES: ClassVar[str] = strategy_notes(tuple(name for name in STRATEGIES if name != "blind_stop"), own=False)

    from_durations: Literal["table", "library"] | None = None
    """Run no missions; fit C0 to C3 to the durations of the primitives: `table` for `durations`, by default Table 2 of
    the paper, `library` for durations measured in simulation."""
    out: Path | None = None
    """Folder to write, which must not exist. Default: results/tune-<hash of the config>."""
