"""A model on a device, in MJX: one step of one simulation, and its warnings."""

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
from jaxbiped.physics.model import REPORT

with contextlib.redirect_stdout(io.StringIO()):  # it prints that MuJoCo Warp is not installed, which concerns few users
    from mujoco import mjx

    from jaxbiped.physics.unsupported_features import refusals

SLOTS = "max_contact_points"
GROWS = {  # sizes of a geom to which a margin is added
    mujoco.mjtGeom.mjGEOM_SPHERE: (1, 0, 0),
    mujoco.mjtGeom.mjGEOM_CAPSULE: (1, 0, 0),
    mujoco.mjtGeom.mjGEOM_CYLINDER: (1, 1, 0),
    mujoco.mjtGeom.mjGEOM_ELLIPSOID: (1, 1, 1),
    mujoco.mjtGeom.mjGEOM_BOX: (1, 1, 1),
}
EDGES = 6  # room for constraint rows per contact in Warp: 4 of friction, and the rest for joint limits
STATE = (  # all that a step reads of the previous data
    *("time", "qpos", "qvel", "act", "history", "qacc_warmstart", "plugin_state", "sensordata"),
    *("ctrl", "qfrc_applied", "xfrc_applied", "mocap_pos", "mocap_quat", "eq_active", "userdata"),
)
WARP_FULL = {  # bits of overflows in Warp; those of iterations are not counted
    "constraint_full": ("NEFC", "NJMAX_NNZ", "NVMAX"),
    "contact_full": ("BROADPHASE", "NARROWPHASE", "CCD", "HFIELD", "CONTACT_MATCH", "EPA_HORIZON", "TACTILE"),
}


def device_of(platform: str | None) -> jax.Device:
    """The first device of a platform; JAX's default if None."""
    try:
        return jax.devices(platform)[0]
    except RuntimeError:
        there = ", ".join(sorted({device.platform for device in jax.devices()}))
        raise InputError(f"no such device is there; JAX sees {there}", field="device", value=platform) from None


def grow(model: mujoco.MjModel) -> np.ndarray:
    """Turn the margins of geoms into size, in place; returns what was added to each size, [ngeom, 3].

    MJX finds a box on a plane only when they touch, and not within the margin: feet at rest would have flickering
    contacts, with forces that jump. A geom that is larger by its margin has the same forces at the same distances.
    """
    growth = np.zeros_like(model.geom_size)
    for g, kind in enumerate(model.geom_type):
        if model.geom_margin[g] and mujoco.mjtGeom(int(kind)) in GROWS:
            growth[g] = np.multiply(GROWS[mujoco.mjtGeom(int(kind))], model.geom_margin[g])
    model.geom_size += growth
    model.geom_rbound += np.linalg.norm(growth, axis=1) * (model.geom_rbound > 0)
    model.geom_margin[growth.any(axis=1)] = 0.0
    return growth


def watched_distances(model: mujoco.MjModel, margin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Columns of the sensor data that are distances of two geoms, and their margins [m], which `grow` removed."""
    columns, margins = [], []
    for s in np.flatnonzero(model.sensor_type == mujoco.mjtSensor.mjSENS_CONTACT):
        ends = {int(model.sensor_objtype[s]), int(model.sensor_reftype[s])}
        if ends == {int(mujoco.mjtObj.mjOBJ_GEOM)} and model.sensor_intprm[s, 0] == REPORT and model.sensor_dim[s] == 2:
            columns.append(model.sensor_adr[s] + 1)
            margins.append(margin[model.sensor_objid[s]] + margin[model.sensor_refid[s]])
    return np.array(columns, int), np.array(margins)


class Engine:
    """MJX's model and empty data, with one contact slot to spare.

    MJX keeps the deepest `max_contact_points` contacts of each dimension and silently drops others. With one more slot,
    a contact in it shows that a contact was, or would have been, dropped.
    """

    def __init__(self, model: mujoco.MjModel, batch_size: int, impl: str, device: str | None, contacts: int):
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
        margin = model.geom_margin.copy()
        self.growth = grow(model) if impl == "jax" else np.zeros_like(model.geom_size)
        self.distances, self.taken = watched_distances(model, margin - model.geom_margin)
        try:
            self.model = mjx.put_model(model, self.device, impl)
            # Warp's contacts are in one buffer for all simulations, its constraints in one per simulation.
            sizes = {"naconmax": contacts * batch_size, "njmax": EDGES * contacts} if impl == "warp" else {}
            self.empty = mjx.make_data(model, device=self.device, impl=impl, **sizes)
        except (NotImplementedError, AssertionError, RuntimeError) as error:
            said = " ".join(str(error).split()) or "a kind of element that it does not know"
            raise InputError(f"MJX cannot step this model: {said}", field="model") from None
        self.impl = impl
        self.static = np.flatnonzero(model.body_weldid[model.geom_bodyid] == 0)
        self.body_of_static = model.geom_bodyid[self.static]
        self.spare: tuple[int, ...] = ()  # contact slots that must stay empty
        if impl == "jax" and limit is not None:
            dims = np.asarray(self.empty._impl.contact.dim)
            last = [np.flatnonzero(dims == dim) for dim in np.unique(dims)]
            self.spare = tuple(int(each[-1]) for each in last if len(each) > limit)

    def field(self, name: str) -> Any:
        """A field of the model on the device, or None if MJX has no such field that may differ."""
        if self.impl == "warp" and name in ("body_pos", "body_quat"):  # bodies that stand still are placed only once
            return None
        holder, key = (self.model.opt, name[4:]) if name.startswith("opt.") else (self.model, name)
        return getattr(holder, key, None)

    def at(self, qpos: Float[Array, "nq"]) -> Any:
        """The data of one simulation in a state."""
        return self.empty.replace(qpos=qpos)

    def initial(self) -> dict[str, Array]:
        """The data of one simulation that a step reads, at its beginning; the step computes everything else."""
        return {name: getattr(self.empty, name) for name in STATE if hasattr(self.empty, name)}

    def contact_count(self) -> int | None:
        """Contact slots of a simulation, each of which costs time in every step; None if they are not fixed."""
        return int(self.empty._impl.ncon) if self.impl == "jax" else None

    def step(self, model: Any, overrides: dict[str, Array], data: Any, control: Float[Array, "nu"]) -> Any:
        """One step of one simulation with its own fields."""
        data = data.replace(ctrl=control)
        if self.growth.any() and "geom_size" in overrides:
            overrides = overrides | {"geom_size": overrides["geom_size"] + self.growth}
        if overrides:
            model = model.tree_replace(overrides)
        if overrides and self.impl == "warp" and len(self.static):
            data = self.place_static(model, data)
        data = mjx.step(model, data)
        if self.taken.any():
            data = data.replace(sensordata=data.sensordata.at[self.distances].add(self.taken))
        return data

    def place_static(self, model: Any, data: Any) -> Any:
        """Put static geoms where the model has them: Warp does so only when it creates its data."""
        body, (w, x, y, z) = self.body_of_static, model.geom_quat[self.static].T
        turned = jnp.stack(
            [
                jnp.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], axis=-1),
                jnp.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], axis=-1),
                jnp.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=-1),
            ],
            axis=-2,
        )
        frame = data.xmat[body]
        place = data.xpos[body] + jnp.einsum("gij,gj->gi", frame, model.geom_pos[self.static])
        return data.replace(
            geom_xpos=data.geom_xpos.at[self.static].set(place),
            geom_xmat=data.geom_xmat.at[self.static].set(frame @ turned),
        )

    def flags(self, data: Any) -> Int[Array, "8"]:
        """The warnings of the last step of one simulation, by the names of WARNINGS."""
        wrong = {f"bad_{name}": ~jnp.all(jnp.abs(getattr(data, name)) < LIMIT) for name in ("qpos", "qvel", "qacc")}
        if self.spare:
            contact, spare = data._impl.contact, np.array(self.spare)
            wrong["contact_full"] = jnp.any(contact.dist[spare] < contact.includemargin[spare])
        if self.impl == "warp":
            from mujoco.mjx.third_party.mujoco_warp._src.types import OverflowType

            for name, kinds in WARP_FULL.items():
                bits = sum(int(OverflowType[kind]) for kind in kinds)
                wrong[name] = jnp.any((data._impl.overflow & bits) != 0)
        return jnp.stack([jnp.asarray(wrong.get(name, False), jnp.int32) for name in WARNINGS])
