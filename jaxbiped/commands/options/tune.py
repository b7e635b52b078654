"""Options of `jaxbiped tune`."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from jaxbiped.study.tuning_config import TuneConfig


class TuneArgs(TuneConfig):
    """Tune the costs C1 to C4 on random arenas, and judge them on others.

    The planner takes the same paths when all costs double, so that C0 stays as it is. A TOML file may come first and
    give the defaults.
    """

    from_durations: Literal["table", "library"] | None = None
    """Play no mission, and fit C0 to C3 to how long the primitives take: those of `durations` (Table 2 of the paper by
    default), or those that simulation measured (`library`)."""
    out: Path | None = None
    """Folder to write, which must not exist. Default: results/tune-<hash of the config>."""
