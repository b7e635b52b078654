"""Primitives as measured in simulation, as read by the executor `sampled`."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import jax
import numpy as np
import pydantic
from jaxtyping import Array, Float

from jaxbiped.config import Model, load

Count = Annotated[int, pydantic.Field(ge=0)]
Three = tuple[float, float, float]
DEFAULT = Path(__file__).with_name("motion_library.toml")
"""The library of the default robot, as `jaxbiped primitives` wrote it."""
PLAYED = ("straight", "turn", "step_up", "step_down", "squat_straight", "sidestep")
"""The primitives that displace the robot, in the order of the arrays of `Library`."""
STEPS = ("step_up", "step_down")
SMALLEST = 1e-12  # added to variances, so that zero variances have a Cholesky factor


class Window(Model):
    """How a step over an edge ends, by the position of the edge. Every combination was tried, otherwise undisturbed."""

    ahead: float
    """[m] Nominal distance from the midpoint of the feet to the edge."""
    edge: Annotated[tuple[float, ...], pydantic.Field(min_length=2)]
    """[m] Distances of the edge beyond the nominal one, ascending."""
    yaw: Annotated[tuple[float, ...], pydantic.Field(min_length=2)]
    """[rad] Anticlockwise rotations of the edge from perpendicular, ascending."""
    stands: tuple[tuple[Annotated[float, pydantic.Field(ge=0.0, le=1.0)], ...], ...]
    """Share of the trials that did not fall; one row per edge, one column per yaw."""

    @pydantic.model_validator(mode="after")
    def _shape(self):
        if len(self.stands) != len(self.edge) or any(len(row) != len(self.yaw) for row in self.stands):
            raise ValueError("stands must have one row per edge and one column per yaw")
        if any(np.any(np.diff(axis) <= 0) for axis in (self.edge, self.yaw)):
            raise ValueError("edge and yaw must be ascending")
        return self


class Rims(Model):
    """Where an edge that a primitive does not step over may lie: [m] outwards from the middle of the nearest sole at
    the robot's final position, ahead of it or to its outer side. The robot falls if it is nearer.

    A rise whose edge is farther ahead stops the toes, and the robot ends short; it does not fall.
    """

    up_ahead: float
    up_aside: float
    down_ahead: float
    down_aside: float


class Feet(Model):
    """The feet of the verified robot."""

    length: Annotated[float, pydantic.Field(gt=0.0)]
    """[m]"""
    width: Annotated[float, pydantic.Field(gt=0.0)]
    """[m]"""
    offset: Annotated[float, pydantic.Field(gt=0.0)]
    """[m] Lateral offset of each sole's middle."""


class Entry(Model):
    """One primitive on the mild set."""

    request: Three
    """Requested (forward, left) [m] and turn [rad]."""
    rise: float
    """[m]"""
    duration: Annotated[float, pydantic.Field(gt=0.0)]
    """[s]"""
    trials: Annotated[int, pydantic.Field(gt=0)]
    falls: Count
    slips: Count
    """Trials that ended upright, but in the wrong place."""
    touches: Count
    """Trials in which head or torso touched something."""
    displacement: Three
    """Mean end pose [m, m, rad] in the start frame, over the trials that did not fall."""
    covariance: tuple[Three, Three, Three]
    """Covariance of the same."""
    sway: Annotated[float, pydantic.Field(ge=0.0)]
    """[m] Largest lateral excursion of the head's middle."""
    window: Window | None = None

    @pydantic.model_validator(mode="after")
    def _counts(self):
        if max(self.falls + self.slips, self.touches) > self.trials:
            raise ValueError("falls, slips and touches cannot be more than the trials")
        if np.linalg.eigvalsh(np.array(self.covariance)).min() < -1e-9:
            raise ValueError("covariance must have no negative eigenvalue")
        return self


class LibraryConfig(Model):
    """Measurements of `jaxbiped primitives`."""

    command: str
    """The command line that wrote it."""
    pace: str
    seed: Count
    feet: Feet
    rims: Rims
    primitives: dict[str, Entry]

    @pydantic.model_validator(mode="after")
    def _complete(self):
        missing = [name for name in PLAYED if name not in self.primitives]
        if missing:
            raise ValueError(f"missions also play {', '.join(missing)}; verify all primitives")
        for name in STEPS:
            if self.primitives[name].window is None:
                raise ValueError(f"{name} needs its window")
        up, down = (self.primitives[name].window for name in STEPS)
        if (up.edge, up.yaw) != (down.edge, down.yaw):
            raise ValueError("the windows of step_up and step_down must have the same edge and yaw")
        return self

    def traced(self) -> Library:
        """The library as arrays."""
        entries = [self.primitives[name] for name in PLAYED]
        windows = [self.primitives[name].window for name in STEPS]
        covariances = np.array([entry.covariance for entry in entries]) + SMALLEST * np.eye(3)
        single = lambda values: jax.device_put(np.asarray(values, np.float32))  # noqa: E731
        return Library(
            request=single([entry.request for entry in entries]),
            bias=single([np.subtract(entry.displacement, entry.request) for entry in entries]),
            root=single(np.linalg.cholesky(covariances)),
            falls=single([entry.falls / entry.trials for entry in entries]),
            sway=single([entry.sway for entry in entries]),
            feet=single(list(self.feet.model_dump().values())),
            rims=single(list(self.rims.model_dump().values())),
            ahead=single([window.ahead for window in windows]),
            edge=single(windows[0].edge),
            yaw=single(windows[0].yaw),
            stands=single([window.stands for window in windows]),
        )


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Library:
    """`LibraryConfig`, traced; the first axis is that of `PLAYED`, for `stands` that of `STEPS`."""

    request: Float[Array, "*B 6 3"]  # [m, m, rad]
    bias: Float[Array, "*B 6 3"]  # mean displacement minus the request
    root: Float[Array, "*B 6 3 3"]  # Cholesky factor of its covariance
    falls: Float[Array, "*B 6"]  # probability
    sway: Float[Array, "*B 6"]  # [m]
    feet: Float[Array, "*B 3"]  # [m] length, width, offset
    rims: Float[Array, "*B 4"]  # [m] up ahead, up aside, down ahead, down aside
    ahead: Float[Array, "*B 2"]  # [m] nominal distance of edges
    edge: Float[Array, "*B E"]  # [m] of the windows, beyond the nominal distance
    yaw: Float[Array, "*B Y"]  # [rad]
    stands: Float[Array, "*B 2 E Y"]  # probability


@functools.lru_cache(maxsize=8)
def load_library(path: Path | None = None) -> LibraryConfig:
    """The library in a file written by `jaxbiped primitives`; the shipped one if None.

    Raises:
      InputError: the file does not exist, or is not a library.
    """
    return load(LibraryConfig, path or DEFAULT)
