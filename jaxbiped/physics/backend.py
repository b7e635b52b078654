"""The protocol of physics backends: batches of simulations of one model, stepped together.

A backend is made for one (model, batch size). `rollout` plays whole control tables; `reset`, `set_fields` and `advance`
keep a batch alive and step it in short slices, so that its simulations may be at different positions of different
tables. Backends know MJCF, but no particular robot.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import jax
import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int

from jaxbiped.core.checks import as_array, shape_of
from jaxbiped.errors import InputError

WARNINGS = (
    "inertia",
    "contact_full",
    "constraint_full",
    "bad_qpos",
    "bad_qvel",
    "bad_qacc",
    "bad_ctrl",
    "engine_error",
)
"""Possible failures of a simulation, by column of `warnings`: MuJoCo's warnings, in its order, and its errors."""

LIMIT = mujoco.mjMAXVAL  # a state beyond it is as bad as NaN, also for the engine itself


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class State:
    """The batch after a slice of steps. NumPy arrays, float64 from `native` and float32 from `mjx`.

    A simulation that is not valid has NaN in `qpos`, `qvel` and `sensordata`, until it is reset.
    Contacts and sensors are those of the beginnings of the steps, as in `mj_step`.
    """

    time: Float[np.ndarray, "B"]  # [s] since its reset
    qpos: Float[np.ndarray, "B nq"]
    qvel: Float[np.ndarray, "B nv"]
    sensordata: Float[np.ndarray, "B ns"]  # the model's own sensors, in its order
    valid: Bool[np.ndarray, "B"]  # no warning since its reset
    warnings: Int[np.ndarray, "B 8"]  # how often, by the names of WARNINGS
    touched: Bool[np.ndarray, "B W"]  # whether any pair of the watch touched in this slice
    depth: Float[np.ndarray, "B W"]  # [m] largest penetration of the watch's pairs in this slice; 0: none
    work: Float[np.ndarray, "B nw"]  # [J] work of each actuator in this slice, without braking; nw = 0 or nu


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Rollout:
    """The recorded motion of a batch. NumPy arrays; record k is of the state after (k + 1) * record_every steps.

    Records at and after a simulation's first warning are NaN: invalid states have no numbers.
    """

    time: Float[np.ndarray, "R"]  # [s] the same for all simulations
    qpos: Float[np.ndarray, "B R nq"]
    qvel: Float[np.ndarray, "B R nv"]
    valid: Bool[np.ndarray, "B"]
    warnings: Int[np.ndarray, "B 8"]  # how often, by the names of WARNINGS
    sensordata: Float[np.ndarray, "B R ns"]
    touched: Bool[np.ndarray, "B W"]  # in the whole rollout
    depth: Float[np.ndarray, "B W"]  # [m]
    work: Float[np.ndarray, "B nw"]  # [J] in the whole rollout


@runtime_checkable
class Backend(Protocol):
    """Steps `batch_size` simulations of `model`. Made by `physics.make`."""

    name: str
    model: mujoco.MjModel
    batch_size: int
    watches: tuple[str, ...]  # names of the columns of `touched` and `depth`

    def rollout(
        self,
        controls: Any,
        qpos: Any = None,
        qvel: Any = None,
        fields: Mapping[str, Any] | None = None,
        record_every: int = 1,
        hold: int = 1,
    ) -> Rollout:
        """Play control tables from given initial states, and leave the living batch unchanged.

        Args:
          controls: [B, T, nu], finite; control k is applied in steps k * hold to (k + 1) * hold - 1.
          qpos: [B, nq] initial positions; the model's `qpos0` if None.
          qvel: [B, nv] initial velocities; 0 if None.
          fields: model fields that differ by simulation, {name: [B, ...]}; the model's own where not named.
          record_every: steps between records; it divides the number of steps, T * hold.
          hold: steps for which each control is held.

        Raises:
          InputError: about a shape, a number that is not finite, or a field that cannot differ by simulation.
        """
        ...

    def reset(self, mask: Any = None, qpos: Any = None, qvel: Any = None) -> State:
        """Set the simulations of `mask` [B] (all if None) to a state at time 0, valid, with no warnings.

        Args:
          mask: [B] bool.
          qpos: [B, nq]; rows outside the mask are ignored. The model's `qpos0` if None.
          qvel: [B, nv]; 0 if None.
        """
        ...

    def set_fields(self, fields: Mapping[str, Any], mask: Any = None) -> None:
        """Give the simulations of `mask` [B] (all if None) their own model fields, {name: [B, ...]}.

        Values that MuJoCo derives from them (inertial constants, bounding volumes, frames) are updated. Rows outside
        the mask are ignored. Names are those of `mujoco.MjModel`, and "opt.gravity" and the like for options.
        """
        ...

    def advance(self, controls: Any, hold: int = 1, mask: Any = None) -> State:
        """Step the simulations of `mask` [B] (all if None) S * hold times; the others stay unchanged.

        `controls` is [B, S, nu], finite, each held for `hold` steps. Masked simulations cost nothing in `native`, and
        as much as the others in `mjx`.
        """
        ...

    def compile(self) -> float:
        """Compile now instead of at the first call; returns the seconds taken."""
        ...


def explain(warnings: Sequence[int] | np.ndarray) -> str:
    """The warnings of one simulation, [8], in words; empty if there were none.

    Raises:
      InputError: warnings of another shape, or not numbers.
    """
    counts = as_array("warnings", warnings)
    if counts.shape != (len(WARNINGS),):
        raise InputError(f"must be [{len(WARNINGS)}], for one simulation, not {shape_of(counts)}", field="warnings")
    return ", ".join(f"{name} x{count}" for name, count in zip(WARNINGS, warnings, strict=True) if count)
