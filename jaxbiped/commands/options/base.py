"""What the options of every command share: which of them most people need, and files of a robot and a camera."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar

import pydantic
import tyro

from jaxbiped.config import Model

FILE_OPTIONS = {"robot_file": "robot", "camera_file": "camera"}  # field: the part of the config that its file is of


class Options(Model):
    """Base of the options of a command."""

    BASIC: ClassVar[tuple[str, ...]] = ()
    """Options that `--help` shows, in this order, `mission.sensor` for one of a group; none: all of them. The rest are
    shown by `--help-all`."""
    NOTES: ClassVar[str] = ""
    """Lines below the options in both."""


class RobotFileOptions(Options):
    """Of commands that have a robot. What the file says is in the config, so that the option is no part of it."""

    robot_file: Annotated[Path | None, tyro.conf.arg(name="robot", metavar="FILE")] = pydantic.Field(None, exclude=True)
    """Robot, a TOML file as those in configs/robots. Options --robot.* win over it."""


class CameraFileOptions(Options):
    """Of commands that have a camera, as `RobotFileOptions`."""

    camera_file: Annotated[Path | None, tyro.conf.arg(name="camera", metavar="FILE")] = pydantic.Field(
        None, exclude=True
    )
    """Camera, a TOML file as those in configs/cameras. Options --camera.* win over it."""
