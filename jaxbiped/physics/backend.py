"""What every physics backend is: batches of simulations of one model, stepped together.

A backend is made for one (model, batch size). `rollout` plays whole control tables; `reset`, `set_fields` and `advance`
keep a batch alive and step it in short slices, so that its simulations may be at different places of different tables.
Backends know MJCF and nothing of any robot.
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
"""What may go wrong in a simulation, by column of `warnings`: the warnings of MuJoCo, in its order, and its errors."""

LIMIT = mujoco.mjMAXVAL  # a state beyond it is as bad as NaN, as it is to the engine itself


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
    touched: Bool[np.ndarray, "B W"]  # whether any pair of the watch did, in this slice
    depth: Float[np.ndarray, "B W"]  # [m] greatest penetration of the watch's pairs in this slice; 0: none
    work: Float[np.ndarray, "B nw"]  # [J] that each actuator gave in this slice, braking not counted; nw = 0 or nu


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Rollout:
    """What a batch did. NumPy arrays; record k is of the state after (k + 1) * record_every steps.

    Records at and after a simulation's first warning are NaN: no number is given for what is not valid.
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
        """Play control tables from given initial states, and leave the living batch as it is.

        Args:
          controls: [B, T, nu], finite; control k is applied in steps k * hold to (k + 1) * hold - 1.
          qpos: [B, nq] initial positions; the model's `qpos0` where None.
          qvel: [B, nv] initial velocities; 0 where None.
          fields: model fields that differ by simulation, {name: [B, ...]}; the model's own where not named.
          record_every: steps between records; it divides the number of steps, T * hold.
          hold: steps for which each control is held.

        Raises:
          InputError: about a shape, a number that is not finite, or a field that cannot differ by simulation.
        """
        ...

    def reset(self, mask: Any = None, qpos: Any = None, qvel: Any = None) -> State:
        """Set the simulations of `mask` [B] (all where None) to a state at time 0, valid, with no warnings.

        Args:
          mask: [B] bool.
          qpos: [B, nq]; rows outside the mask are ignored. The model's `qpos0` where None.
          qvel: [B, nv]; 0 where None.
        """
        ...

    def set_fields(self, fields: Mapping[str, Any], mask: Any = None) -> None:
        """Give the simulations of `mask` [B] (all where None) their own model fields, {name: [B, ...]}.

        What MuJoCo derives from them (inertial constants, bounding volumes, frames) follows. Rows outside the mask
        are ignored. Names are those of `mujoco.MjModel`, and "opt.gravity" and the like for options.
        """
        ...

    def advance(self, controls: Any, hold: int = 1, mask: Any = None) -> State:
        """Step the simulations of `mask` [B] (all where None) S * hold times; the others stay as they are.

        `controls` is [B, S, nu], finite, each held for `hold` steps. What is masked costs nothing in `native`, and as
        much as the rest in `mjx`.
        """
        ...

    def compile(self) -> float:
        """Do now what the first call would do first; returns the seconds that it took."""
        ...


def explain(warnings: Sequence[int] | np.ndarray) -> str:
    """The warnings of one simulation, [8], in words; empty where there were none.

    Raises:
      InputError: of another shape, or no numbers.
    """
    counts = as_array("warnings", warnings)
    if counts.shape != (len(WARNINGS),):
        raise InputError(f"must be [{len(WARNINGS)}], of one simulation, not {shape_of(counts)}", field="warnings")
    return ", ".join(f"{name} x{count}" for name, count in zip(WARNINGS, warnings, strict=True) if count)
