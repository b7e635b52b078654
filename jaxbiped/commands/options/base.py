"""What the options of every command share: the basic options, and files of a robot and a camera."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar

import pydantic
import tyro

from jaxbiped.config import Model

FILE_OPTIONS = {"robot_file": "robot", "camera_file": "camera"}  # field: the part of the config that the file describes


class Options(Model):
    """Base of the options of a command."""

    BASIC: ClassVar[tuple[str, ...]] = ()
    """Options that `--help` shows, in this order, such as `mission.sensor` for one of a group; empty: all of them. The
    rest are shown by `--help-all`."""
    NOTES: ClassVar[str] = ""
    """Lines below the options in both."""


class RobotFileOptions(Options):
    """For commands that have a robot. The file's content goes into the config, so this option is not part of it."""

    robot_file: Annotated[Path | None, tyro.conf.arg(name="robot", metavar="FILE")] = pydantic.Field(None, exclude=True)
    """Robot, a TOML file like those in configs/robots. Options --robot.* override it."""


class CameraFileOptions(Options):
    """For commands that have a camera; see `RobotFileOptions`."""

    camera_file: Annotated[Path | None, tyro.conf.arg(name="camera", metavar="FILE")] = pydantic.Field(
        None, exclude=True
    )
    """Camera, a TOML file like those in configs/cameras. Options --camera.* override it."""
