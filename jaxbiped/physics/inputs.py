"""Checks of the inputs of a backend: one clear line before anything is stepped or compiled."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Bool, Float64
from mujoco.batch import MODEL_FIELDS

from jaxbiped.errors import InputError

NOT_NEGATIVE = ("body_mass", "body_inertia", "geom_size", "geom_friction", "dof_armature", "dof_frictionloss")
MOST_STEPS = 2**31 - 1  # in one call: the engine counts in 32 bits
MOST_SIMULATIONS = 10_000_000  # more than any memory holds


def size(name: str, value: Any, least: int = 1, most: int = MOST_STEPS) -> int:
    """A whole number of at least `least` and at most `most`."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise InputError(f"must be a whole number of at least {least}", field=name, value=value)
    if value > most:
        raise InputError(f"must be at most {most:,}", field=name, value=value)
    return int(value)


def numbers(
    name: str, value: Any, shape: tuple[int, ...], axes: str, mask: Bool[np.ndarray, "B"] | None = None
) -> Float64[np.ndarray, "..."]:
    """`value` as finite float64 with `shape`, where -1 is any length; only the rows of the mask need be finite."""
    if isinstance(value, jax.core.Tracer):
        message = "must be known: simulations run on the host, outside of jax.jit, jax.vmap and jax.grad"
        raise InputError(message, field=name)
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "biuf" and not jnp.issubdtype(array.dtype, jnp.floating):
            raise TypeError
        array = array.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"must be numbers of shape {axes}", field=name, value=value) from None
    if array.ndim != len(shape) or any(want not in (-1, got) for want, got in zip(shape, array.shape, strict=True)):
        wanted = ", ".join("any" if n == -1 else str(n) for n in shape)
        raise InputError(f"must have shape {axes} = [{wanted}]", field=name, value=list(array.shape))
    bad = ~np.isfinite(array)
    if mask is not None:
        bad[~mask] = False
    if bad.any():
        at = tuple(int(i) for i in np.argwhere(bad)[0])
        raise InputError(f"must be finite; at {axes} = {list(at)} it is not", field=name, value=float(array[at]))
    return array


def controls(value: Any, batch_size: int, model: mujoco.MjModel) -> Float64[np.ndarray, "B T nu"]:
    """A control table [B, T, nu], T at least 1."""
    table = numbers("controls", value, (batch_size, -1, model.nu), "[B, T, nu]")
    if not table.shape[1]:
        raise InputError("must hold at least one control", field="controls", value=list(table.shape))
    return table


def state(
    qpos: Any, qvel: Any, batch_size: int, model: mujoco.MjModel, mask: Bool[np.ndarray, "B"] | None = None
) -> tuple[Float64[np.ndarray, "B nq"], Float64[np.ndarray, "B nv"]]:
    """Initial states, by default the model's own; rows outside the mask are not checked."""
    if qpos is None:
        qpos = np.tile(model.qpos0, (batch_size, 1))
    if qvel is None:
        qvel = np.zeros((batch_size, model.nv))
    return (
        numbers("qpos", qpos, (batch_size, model.nq), "[B, nq]", mask),
        numbers("qvel", qvel, (batch_size, model.nv), "[B, nv]", mask),
    )


def every(count: int, record_every: int | None, hold: int) -> tuple[int, int]:
    """Steps per record (all if None) and steps per control, for a table of `count` controls."""
    hold = size("hold", hold)
    steps = count * hold
    if steps > MOST_STEPS:
        raise InputError(f"must give at most {MOST_STEPS:,} steps in all", field="hold", value=hold)
    interval = steps if record_every is None else size("record_every", record_every)
    if steps % interval:
        raise InputError(f"must divide the {steps} steps of the rollout", field="record_every", value=record_every)
    return interval, hold


def chosen(mask: Any, batch_size: int) -> Bool[np.ndarray, "B"]:
    """A mask of simulations; all if it is None."""
    if mask is None:
        return np.ones(batch_size, bool)
    try:
        array = np.asarray(mask)
    except (TypeError, ValueError):  # ragged, or traced
        array = np.empty(0)
    if array.dtype != bool or array.shape != (batch_size,):
        raise InputError(f"must be [B] = [{batch_size}] booleans", field="mask", value=mask)
    return array


def own(model: mujoco.MjModel, name: str) -> np.ndarray:
    """The model's own value of a field, or of an option by "opt.<name>"."""
    holder, key = (model.opt, name[4:]) if name.startswith("opt.") else (model, name)
    return np.asarray(getattr(holder, key))


def field_name(model: mujoco.MjModel, name: str) -> str:
    """A field that may differ by simulation: real numbers that do not affect sizes, time or names."""
    if not isinstance(name, str) or name not in MODEL_FIELDS:
        raise InputError(
            "must be the name of a field of mujoco.MjModel that can have one value per simulation", field=name
        )
    if own(model, name).dtype.kind != "f" or name in ("opt.timestep", "numeric_data"):
        raise InputError("is the same in all simulations of a batch", field=name)
    return name


def fields(
    values: Mapping[str, Any] | None, batch_size: int, model: mujoco.MjModel, mask: Bool[np.ndarray, "B"] | None = None
) -> dict[str, Float64[np.ndarray, "B ..."]]:
    """Model fields by name, each with a leading [B]."""
    out = {}
    if values is not None and not isinstance(values, Mapping):
        raise InputError("must be {name: [B, ...]}", field="fields", value=type(values).__name__)
    for name, value in (values or {}).items():
        shape = own(model, field_name(model, name)).shape
        array = numbers(f"fields.{name}", value, (batch_size, *shape), f"[B, *{name}.shape]", mask)
        rows = array if mask is None else array[mask]
        if name in NOT_NEGATIVE and (rows < 0).any():  # the engine would continue, without contacts
            raise InputError("must be 0 or more", field=f"fields.{name}", value=float(rows.min()))
        out[name] = array
    return out
