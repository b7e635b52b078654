"""Options of `jaxbiped plan`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro
from pydantic import Field

from jaxbiped.commands.options.base import Options
from jaxbiped.mission.config import CostConfig

Cost = Annotated[float, Field(ge=0.0, le=1e6)]
Position = Annotated[tuple[float, float] | None, tyro.conf.arg(metavar="X Y")]
PAPER = CostConfig()
Name = Annotated[Path | None, tyro.conf.arg(metavar="PATH")]


class PlanArgs(Options):
    """Plan a path on a map: Moving AI .map, a PNG or PGM with its ROS map_server YAML, or a class grid .npz."""

    file: tyro.conf.Positional[Path]
    """The map: FILE.map, FILE.yaml (or its picture), or FILE.npz."""
    start: Position = None
    """X Y [m] in the map's frame; for a Moving AI map, column and row [cells] from the upper left."""
    goal: Position = None
    """X Y, as for --start."""
    scenario: Name = None
    """A Moving AI scenario (.scen): check each of its optimal lengths, instead of --start and --goal."""
    sample: Annotated[int | None, Field(ge=1), tyro.conf.arg(metavar="INT")] = None
    """Check only this many queries of the scenario, evenly spread. Default: all."""
    c0: Annotated[float, Field(ge=1e-3, le=1e6)] = PAPER.c0
    """Cost of distance, per 5 cm. All costs are the paper's, scaled to the map's cells."""
    c1: Cost = PAPER.c1
    """Cost of walking on one level, per 5 cm."""
    c2: Cost = PAPER.c2
    """Cost of a gate, per 5 cm."""
    c3: Cost = PAPER.c3
    """Cost of one step up or down."""
    c4: Cost = PAPER.c4
    """Cost of an unmeasured cell, per 5 cm."""
    corner_cutting: bool = False
    """Allow diagonal moves past one blocked cell."""
    radius: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    """[m] Grow obstacles by this much, for a disc-shaped robot on a plain occupancy map."""
    robot: Name = None
    """A robot's TOML file, whose radius is used as --radius."""
    pitch: Annotated[float, Field(gt=0.0, le=1000.0)] = 0.05
    """[m] Side of a cell of a Moving AI map, since its file does not say."""
    out: Name = None
    """Folder to write, which must not exist. Default: results/plan-<hash of these options>."""
