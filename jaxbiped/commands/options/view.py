"""Options of `jaxbiped view`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import pydantic
import tyro

from jaxbiped.commands.options.base import Options


class ViewArgs(Options):
    """Show missions in the browser: arena, robot, points, maps, plan and pictures, at any time of the mission."""

    result: tyro.conf.Positional[Path]
    """A folder written by `jaxbiped run`, `compare`, `sweep` or `reproduce`. Missions of a study are played again."""
    port: Annotated[int, pydantic.Field(ge=0, le=65535)] = 8080
    """Port to serve the page on; 0: any free one."""
    host: str = "127.0.0.1"
    """Address to listen on; 0.0.0.0 lets other machines connect."""
    strategy: str | None = None
    """Of a study: the strategy to start with; by default the first one."""
    arena: Annotated[int, pydantic.Field(ge=0)] | None = None
    """Of a study: the arena to start with; by default that of the median time. Of a folder with several recorded
    missions: the number of the mission."""
    point: Annotated[int, pydantic.Field(ge=0)] | None = None
    """Of a sweep: the point to start with; default 0."""
    browser: bool = True
    """Open the page in the browser."""
    once: bool = False
    """Exit when the page is ready, without waiting for Ctrl-C."""
