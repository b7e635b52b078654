"""Options of `jaxbiped primitives`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar, Literal

import pydantic

from jaxbiped.biped.primitive_catalogue import PAPER, Pace
from jaxbiped.commands.options.base import Options
from jaxbiped.motion.config import Goal

Name = Literal[tuple(PAPER)]


class PrimitivesArgs(Options):
    """Generate the motion primitives and verify them in simulation: undisturbed, on a mild and a hard set of
    disturbances, and with each disturbance alone. Write tables, the library that `--executor sampled` reads, and
    videos.
    """

    BASIC: ClassVar[tuple[str, ...]] = (*("pace", "optimise", "only", "draws", "seed", "robot", "videos", "out"),)

    pace: Pace = "paper"
    """Table 2's durations, or as fast as servos and balance safely allow (as missions in simulation play them)."""
    optimise: Goal | None = None
    """Search phases and pressure points by gradient: `duration`, the shortest primitive within the servos' limits, or
    `margin`, the widest stability margin at the pace's duration."""
    only: Annotated[tuple[Name, ...], pydantic.Field(min_length=1)] = tuple(PAPER)
    """Which primitives."""
    draws: Annotated[int, pydantic.Field(ge=1, le=100_000)] = 128
    """Trials in each set."""
    seed: Annotated[int, pydantic.Field(ge=0, lt=2**32)] = 0
    """Seed of the disturbances; the first ones are the same in a larger set."""
    backend: Literal["native", "mjx", "auto"] = "native"
    """What steps the simulation: MuJoCo on CPU threads, or MJX."""
    device: Literal["cpu", "gpu", "tpu"] | None = None
    """Device of MJX; by default that of JAX."""
    robot: Path | None = None
    """Robot model, a TOML file such as configs/robots/enuvo_walk_model.toml; its values are the defaults."""
    bump: Annotated[float, pydantic.Field(gt=0.0, le=1.0)] = 0.03
    """[m] Height of the bump to step over."""
    gate: Annotated[float, pydantic.Field(gt=0.0, le=10.0)] = 0.37
    """[m] Clear height of the gate to pass."""
    videos: bool = True
    """Write a video of each primitive, played undisturbed."""
    against: Literal["mjx"] | None = None
    """Write nothing, and print how much this backend differs from `native`: at every moment of each primitive, and in
    the outcomes of 64 steps up of which about a third fails. Exit status 1 if by more than 1 mm, or in any outcome."""
    out: Path | None = None
    """Folder to write, which must not exist. Default: results/primitives."""
