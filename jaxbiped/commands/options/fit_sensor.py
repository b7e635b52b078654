"""Options of `jaxbiped fit-sensor`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import pydantic

from jaxbiped.commands.options.base import Options


class FitSensorArgs(Options):
    """Render arenas, watch the matcher and the landmarks, fit the noise of the ray-cast sensor to what is seen, and
    say how close the two sensors come on other arenas. The file that is written goes with --preset."""

    camera: Path | None = None
    """A camera file (TOML); default: the paper's camera."""
    arenas: Annotated[int, pydantic.Field(ge=1, le=1000)] = 12
    """Random arenas that are fitted to, all families in turn; as many others are for comparison."""
    views: Annotated[int, pydantic.Field(ge=1, le=1000)] = 10
    """Places in each, aimed at gates, bumps and obstacles."""
    missions: Annotated[int, pydantic.Field(ge=0, le=1000)] = 12
    """Of both sensors, on the arenas for comparison."""
    seed: Annotated[int, pydantic.Field(ge=0, lt=2**32)] = 1
    """Of the arenas, the places and all noise."""
    out: Path | None = None
    """Sensor file to write, which must not exist. Default: results/fit-sensor-<hash of these options>.toml"""
