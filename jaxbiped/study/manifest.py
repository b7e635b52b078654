"""The manifest of a results folder: what its rows are, and how they were made."""

from __future__ import annotations

import json
import platform
from importlib import metadata
from pathlib import Path
from typing import Any, Literal

import jax
import polars as pl
import pydantic

from jaxbiped import __version__
from jaxbiped.config import Model, parse
from jaxbiped.errors import InputError
from jaxbiped.mission.metric import MetricFormat

FORMAT = 1
MANIFEST = "manifest.json"
UNREADABLE = (pl.exceptions.PolarsError, OSError, pydantic.ValidationError, ValueError)


class Manifest(Model):
    """What a results folder holds and how it was made."""

    format: int = FORMAT
    state: Literal["running", "stopped", "finished"]
    command: str
    """The command line that wrote the folder."""
    config: dict[str, Any]
    """The resolved configuration."""
    config_hash: str
    versions: dict[str, str]
    device: str
    seed: int
    arenas: int
    """Number of arenas that the study will have for each sweep point."""
    started: str
    """ISO 8601, UTC."""
    wall_time: float | None = None
    """Seconds from start to finish, including compilation; while unfinished, up to the last shard. For a resumed study
    the sum over all runs, without the work that was lost when one stopped."""
    compile_time: float | None = None
    """Seconds of compilation in the same runs."""
    resumed: int = 0
    """How often the study was resumed."""
    shards: int | None = None
    rows: int | None = None
    """Rows in all shards, once finished."""
    metrics: dict[str, MetricFormat] = pydantic.Field(default_factory=dict)
    """How the numbers in the columns of metrics are displayed."""


def versions() -> dict[str, str]:
    """Versions of everything that results may depend on."""
    packages = {name: metadata.version(name) for name in ("jax", "jaxlib", "numpy", "mujoco")}
    return {"jaxbiped": __version__, **packages, "python": platform.python_version()}


def device() -> str:
    """The devices of this process in words, such as "2 x cpu"."""
    devices = jax.devices()
    return f"{len(devices)} x {devices[0].device_kind}"


def read_manifest(folder: str | Path) -> Manifest:
    """The manifest of a results folder; `InputError` if there is none, or none that this version can read."""
    path = Path(folder) / MANIFEST
    if not Path(folder).is_dir():
        raise InputError("no such results folder", file=folder)
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"is not a results folder; it has no {MANIFEST}", file=folder) from None
    except UNREADABLE:
        raise InputError("is not valid JSON", file=path) from None
    found = data.get("format") if isinstance(data, dict) else None
    if found != FORMAT:
        raise InputError(f"this version reads manifests of format {FORMAT}", file=path, field="format", value=found)
    return parse(Manifest, data, file=path)
