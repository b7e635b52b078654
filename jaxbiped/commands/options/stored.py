"""Options of `jaxbiped compare FOLDER`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar, Literal

import pydantic
import tyro

from jaxbiped.commands.options.base import Options

Share = Annotated[float, pydantic.Field(gt=0.0, lt=1.0)]
Amount = Annotated[float, pydantic.Field(gt=0.0)]


class StoredArgs(Options):
    """Compare two strategies or sweep points of stored results, on the same arenas, without running again."""

    BASIC: ClassVar[tuple[str, ...]] = (
        *("folders", "first", "second", "first_point", "second_point"),
        *("margin_success", "plan_power", "wanted_difference", "out"),
    )

    folders: tyro.conf.Positional[Annotated[tuple[Path, ...], pydantic.Field(min_length=1, max_length=2)]]
    """One results folder, or two on the same arenas: then the first side is from the first folder."""
    first: str | None = None
    """Strategy of the first side. Differences are first minus second."""
    second: str | None = None
    first_point: Annotated[int, pydantic.Field(ge=0)] | None = None
    """Sweep point of the first side; default 0."""
    second_point: Annotated[int, pydantic.Field(ge=0)] | None = None
    """Default: that of the first side."""
    level: Share = 0.95
    """Confidence level of the intervals."""
    resamples: Annotated[int, pydantic.Field(ge=10, le=1_000_000)] = 4999
    """Seed of the bootstraps."""
    margin_success: Share | None = None
    """Test whether success rates differ by less than this fraction."""
    margin_distance: Amount | None = None
    """[m] The same for distance."""
    margin_time: Amount | None = None
    """[s] The same for time."""
    plan_power: bool = False
    """Report how many arenas would show `--wanted-difference`, taking these results as a pilot."""
    wanted_difference: Amount | None = None
    """[fraction, m or s] The difference to show, in units of `--measure`."""
    measure: Literal["success", "distance", "time"] = "success"
    power: Share = 0.8
    out: Path | None = None
    """Folder to write the tables and a page to, which must not exist; by default nothing is written."""
