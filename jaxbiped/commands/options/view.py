"""Options of `jaxbiped view`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import pydantic
import tyro

from jaxbiped.commands.options.base import Options


class ViewArgs(Options):
    """Show missions in the browser: arena, robot, points, maps, plan and pictures, at any time of them."""

    result: tyro.conf.Positional[Path]
    """A folder that `jaxbiped run`, `compare`, `sweep` or `reproduce` wrote. Of a study, missions are played again."""
    port: Annotated[int, pydantic.Field(ge=0, le=65535)] = 8080
    """To serve the page on; 0: any that is free."""
    host: str = "127.0.0.1"
    """Address to listen to; 0.0.0.0 lets other machines look, too."""
    strategy: str | None = None
    """Of a study: whose mission to begin with; by default the first there is."""
    arena: Annotated[int, pydantic.Field(ge=0)] | None = None
    """Of a study: the arena to begin with; by default that of the median time. Of a folder with several recorded
    missions: their number."""
    point: Annotated[int, pydantic.Field(ge=0)] | None = None
    """Of a sweep: the point to begin with; default 0."""
    browser: bool = True
    """Open the page in the browser."""
    once: bool = False
    """End when the page is there, without waiting for Ctrl-C."""
