"""Options of `jaxbiped report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import pydantic
import tyro

from jaxbiped.commands.options.base import Options


class ReportArgs(Options):
    """Rewrite report.html, summary.md and the figures of a results folder, and print its tables."""

    folder: tyro.conf.Positional[Path]
    """A folder that `jaxbiped compare` or `jaxbiped sweep` wrote."""
    point: Annotated[int, pydantic.Field(ge=0)] | None = None
    """For a sweep: the point at which strategies are compared in full; by default that with the config's own values."""
    examples: Annotated[int, pydantic.Field(ge=0, le=50)] = 3
    """Arenas where the two strategies differ most, to replay and draw; this compiles a mission. 0: none."""
