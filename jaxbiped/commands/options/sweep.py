"""Options of `jaxbiped sweep`."""

from __future__ import annotations

from pathlib import Path

from jaxbiped.commands.options.engine import EngineArgs
from jaxbiped.study.sweep import SweepConfig


class SweepArgs(EngineArgs, SweepConfig):
    """Sweep numbers of the config: missions on the same random arenas at each point, tables and figures.

    The sweep in TOML comes first, such as sweeps/costs.toml; options on the command line override it.
    """

    out: Path | None = None
    """Folder to write, which must not exist. Default: results/sweep-<hash of the sweep>."""
    resume: bool = False
    """Go on with the same sweep in the folder, where it was stopped; or begin it."""
