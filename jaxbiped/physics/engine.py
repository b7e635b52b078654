"""A model on a device, in MJX: one step of one simulation, and what went wrong in it."""

from __future__ import annotations

import contextlib
import copy
import importlib.util
import io
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Float, Int

from jaxbiped.errors import InputError
from jaxbiped.physics.backend import LIMIT, WARNINGS

with contextlib.redirect_stdout(io.StringIO()):  # it prints that MuJoCo Warp is not installed; few need to know
    from mujoco import mjx

    from jaxbiped.physics.refusals import refusals

SLOTS = "max_contact_points"


def device_of(platform: str | None) -> jax.Device:
    """The first device of a platform; JAX's default where it is None."""
    try:
        return jax.devices(platform)[0]
    except RuntimeError:
        there = ", ".join(sorted({device.platform for device in jax.devices()}))
        raise InputError(f"no such device is there; JAX sees {there}", field="device", value=platform) from None


class Engine:
    """MJX's model and empty data, with one contact slot to spare.

    MJX keeps the deepest `max_contact_points` contacts of each dimension and drops others unseen. With one slot more,
    a contact in it shows that a contact was, or would have been, dropped.
    """

    def __init__(self, model: mujoco.MjModel, impl: str, device: str | None):
        if impl == "warp" and importlib.util.find_spec("warp") is None:
            raise InputError("needs the package warp-lang, which is not installed", field="impl", value=impl)
        self.device = device_of(device)
        refused = next(refusals(model), None)
        if refused:
            raise InputError(f"MJX cannot step this model: {refused}", field="model")
        model = copy.copy(model)
        slots = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, SLOTS)
        limit = int(model.numeric_data[slots]) if slots >= 0 else None
        if limit is not None:
            model.numeric_data[slots] = limit + 1
        try:
            self.model = mjx.put_model(model, self.device, impl)
            self.empty = mjx.make_data(model, device=self.device, impl=impl)
        except (NotImplementedError, AssertionError, RuntimeError) as error:
            raise InputError(f"MJX cannot step this model: {error}", field="model") from None
        self.impl = impl
        self.spare: tuple[int, ...] = ()  # contacts that must stay without contact
        if impl == "jax" and limit is not None:
            dims = np.asarray(self.empty._impl.contact.dim)
            last = [np.flatnonzero(dims == dim) for dim in np.unique(dims)]
            self.spare = tuple(int(each[-1]) for each in last if len(each) > limit)

    def field(self, name: str) -> Any:
        """A field of the model on the device, or None where MJX has none of this name."""
        holder, key = (self.model.opt, name[4:]) if name.startswith("opt.") else (self.model, name)
        return getattr(holder, key, None)

    def contact_count(self) -> int | None:
        """Contact slots of a simulation, each of which is paid for in every step; None where they are not fixed."""
        return int(self.empty._impl.ncon) if self.impl == "jax" else None

    def step(self, model: Any, overrides: dict[str, Array], data: Any, control: Float[Array, "nu"]) -> Any:
        """One step of one simulation with its own fields."""
        return mjx.step(model.tree_replace(overrides) if overrides else model, data.replace(ctrl=control))

    def flags(self, data: Any) -> Int[Array, "8"]:
        """What went wrong in the last step of one simulation, by the names of WARNINGS."""
        wrong = {f"bad_{name}": ~jnp.all(jnp.abs(getattr(data, name)) < LIMIT) for name in ("qpos", "qvel", "qacc")}
        if self.spare:
            contact, spare = data._impl.contact, np.array(self.spare)
            wrong["contact_full"] = jnp.any(contact.dist[spare] < contact.includemargin[spare])
        return jnp.stack([jnp.asarray(wrong.get(name, False), jnp.int32) for name in WARNINGS])
