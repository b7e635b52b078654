"""Where the shards of a study are computed: options shared by several commands."""

from __future__ import annotations

from typing import Annotated

import pydantic

from jaxbiped.commands.options.base import Options


class EngineArgs(Options):
    """Options of `engine`."""

    scheduler: str | None = None
    """Address of a Dask scheduler, such as tcp://host:8786: its workers compute the shards. Needs jaxbiped[cluster]."""
    workers: Annotated[int, pydantic.Field(ge=1, le=1024)] | None = None
    """The same, with this many worker processes on this machine; its cores are divided among them."""
