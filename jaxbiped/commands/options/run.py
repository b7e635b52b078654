"""Options of `jaxbiped run`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import pydantic
import tyro

from jaxbiped.config import Model
from jaxbiped.mission.config import MissionConfig
from jaxbiped.study.config import StrategyName


class RunArgs(Model):
    """Run one mission in a scene: print what the robot plays, and write pictures of its map."""

    scene: tyro.conf.Positional[Path]
    """The scene, a TOML file; the paper's six are in configs/scenes."""
    strategy: StrategyName = "full"
    """What the robot dares: full, bump_aware (no gates), gate_aware (no bumps), floor_only, or blind_stop, which walks
    straight ahead; or package.module:name of your own."""
    seed: Annotated[int, pydantic.Field(ge=0, lt=2**32)] = 0
    """Of all noise."""
    out: Path | None = None
    """Folder to write, which must not exist. Default: results/run-<scene>-<strategy>-<hash of these options>."""
    mission: Annotated[MissionConfig, tyro.conf.arg(name="")] = MissionConfig()
