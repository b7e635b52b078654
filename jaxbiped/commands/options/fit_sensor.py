"""Options of `jaxbiped fit-sensor`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import pydantic

from jaxbiped.commands.options.base import Options


class FitSensorArgs(Options):
    """Render arenas, evaluate the matcher and the landmark detector, fit the noise of the ray-cast sensor to them, and
    report how well the two sensors agree on other arenas. Use the file that is written with --preset."""

    camera: Path | None = None
    """A camera file (TOML); default: the paper's camera."""
    arenas: Annotated[int, pydantic.Field(ge=1, le=1000)] = 12
    """Random arenas for the fit, from all families in turn; as many others are used for the comparison."""
    views: Annotated[int, pydantic.Field(ge=1, le=1000)] = 10
    """Views of each arena, aimed at gates, bumps and obstacles."""
    missions: Annotated[int, pydantic.Field(ge=0, le=1000)] = 12
    """Missions of both sensors, on the arenas of the comparison."""
    seed: Annotated[int, pydantic.Field(ge=0, lt=2**32)] = 1
    """Seed of the arenas, the views and all noise."""
    out: Path | None = None
    """Sensor file to write, which must not exist. Default: results/fit-sensor-<hash of these options>.toml"""
