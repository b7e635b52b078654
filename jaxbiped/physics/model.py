"""Compile MJCF to a model that can be stepped in batches, with sensors for the watched contacts."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import mujoco
import numpy as np

from jaxbiped.errors import InputError
from jaxbiped.physics.mjcf_errors import mjcf_problem

Watches = Mapping[str, Sequence[tuple[str, str]]]

REPORT = sum(1 << int(f) for f in (mujoco.mjtConDataField.mjCONDATA_FOUND, mujoco.mjtConDataField.mjCONDATA_DIST))
WORK = "work/"  # prefix of the names of actuator sensors
PREFIX = "watch/"  # prefix of the contact sensors; they come after the model's own sensors


def load(source: Any, *, free_joint: bool = False, watch: Watches | None = None, work: bool = False) -> mujoco.MjModel:
    """Compile a model.

    Args:
      source: the path of an MJCF file, MJCF text, a `mujoco.MjSpec`, or a `mujoco.MjModel`. It is not modified.
      free_joint: whether the model must have a free joint.
      watch: {name: pairs of geom names}: contacts to watch. For each pair the model gets a contact sensor, after its
        own ones, so a `mujoco.MjModel` cannot be given.
      work: whether the model also gets sensors of each actuator's force and velocity.

    Raises:
      InputError: if it cannot be read, parsed or compiled, has no free joint, or lacks a watched geom.
    """
    file = None
    if isinstance(source, mujoco.MjModel):
        for field, wanted in (("watch", watch), ("work", work)):
            if wanted:
                message = "sensors can be added to MJCF or a mujoco.MjSpec, not to a compiled model"
                raise InputError(message, field=field)
        model = copy.copy(source)
    else:
        spec, file = read(source)
        try:
            add_watches(spec, watch or {})
            if work:
                add_power(spec)
            model = spec.compile()
        except ValueError as error:
            raise InputError(f"is not a valid model: {mjcf_problem(error)}", file=file) from None
    if (watch or work) and model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_SENSOR:
        raise InputError(
            "must not be disabled: contacts and work are measured by sensors", file=file, field="flag.sensor"
        )
    if free_joint and mujoco.mjtJoint.mjJNT_FREE not in model.jnt_type:
        raise InputError("the model must have a free joint", file=file, field="joint")
    return model


def read(source: Any) -> tuple[mujoco.MjSpec, Path | None]:
    """A specification that may be modified, and the file that it came from."""
    if isinstance(source, mujoco.MjSpec):
        return source.copy(), None
    if isinstance(source, str) and source.lstrip().startswith("<"):
        try:
            return mujoco.MjSpec.from_string(source), None
        except ValueError as error:
            raise InputError(f"the MJCF does not parse: {mjcf_problem(error)}", field="model") from None
    if not isinstance(source, str | Path):
        raise InputError("must be MJCF, its path, a mujoco.MjSpec or a mujoco.MjModel", field="model", value=source)
    file = Path(source)
    if not file.is_file():
        raise InputError("no such file", file=file)
    try:
        return mujoco.MjSpec.from_file(str(file)), file
    except ValueError as error:
        raise InputError(f"the MJCF does not parse: {mjcf_problem(error)}", file=file) from None


def add_watches(spec: mujoco.MjSpec, watch: Watches) -> None:
    """One contact sensor per pair of geoms: whether they touch, and the smallest distance."""
    geoms = {geom.name for geom in spec.geoms if geom.name}
    for name, pairs in watch.items():
        for i, pair in enumerate(pairs):
            missing = [geom for geom in pair if geom not in geoms]
            if missing:
                raise InputError(f"must be pairs of the model's named geoms: {', '.join(sorted(geoms))}",
                                 field=f"watch.{name}", value=missing[0])  # fmt: skip
            sensor = spec.add_sensor(name=f"{PREFIX}{name}/{i}", type=mujoco.mjtSensor.mjSENS_CONTACT)
            sensor.objtype = sensor.reftype = mujoco.mjtObj.mjOBJ_GEOM
            sensor.objname, sensor.refname = pair
            sensor.intprm[:3] = REPORT, 1, 1  # reported values; the nearest; of one contact


def add_power(spec: mujoco.MjSpec) -> None:
    """Sensors of the force and the velocity of each actuator."""
    for kind, sort in (
        ("force", mujoco.mjtSensor.mjSENS_ACTUATORFRC),
        ("velocity", mujoco.mjtSensor.mjSENS_ACTUATORVEL),
    ):
        for k, actuator in enumerate(spec.actuators):
            actuator.name = actuator.name or f"{WORK}actuator/{k}"
            sensor = spec.add_sensor(name=f"{WORK}{kind}/{k}", type=sort)
            sensor.objtype, sensor.objname = mujoco.mjtObj.mjOBJ_ACTUATOR, actuator.name


@dataclass(frozen=True)
class Watched:
    """The layout of a model's sensor data: its own, watched contacts and actuators."""

    own: int  # number of leading columns that are the model's own
    columns: tuple[int, ...]  # of each pair: found here, distance in the next
    group: tuple[int, ...]  # of each pair: the index of its watch
    names: tuple[str, ...]
    forces: tuple[int, ...] = ()  # column of each actuator's force, if its work is requested
    velocities: tuple[int, ...] = ()  # and of its velocity

    @classmethod
    def of(cls, model: mujoco.MjModel, watch: Watches, work: bool = False) -> Watched:
        """The layout of a model that `load` compiled with these watches."""
        pairs = [(i, f"{PREFIX}{name}/{k}") for i, name in enumerate(watch) for k in range(len(watch[name]))]
        columns = tuple(int(model.sensor(name).adr[0]) for _, name in pairs)
        forces, velocities = (
            tuple(int(model.sensor(f"{WORK}{kind}/{k}").adr[0]) for k in range(model.nu if work else 0))
            for kind in ("force", "velocity")
        )
        own = min((*columns, *forces), default=model.nsensordata)
        return cls(own, columns, tuple(i for i, _ in pairs), tuple(watch), forces, velocities)

    def power(self, sensordata: Any, xp: ModuleType) -> Any:
        """[..., ns] -> [..., nu] W: the power of each actuator at the beginning of a step; 0 while it brakes.

        Without columns if work is not requested.
        """
        forces, velocities = (np.array(columns, int) for columns in (self.forces, self.velocities))
        return xp.maximum(sensordata[..., forces] * sensordata[..., velocities], 0.0)

    def depths(self, sensordata: Any, xp: ModuleType) -> Any:
        """[..., ns] -> [..., W] m: largest penetration of each watch's pairs; -inf if none touches.

        `xp` is NumPy or jax.numpy. A contact within a margin but apart does not count as touching.
        """
        out = []
        for i in range(len(self.names)):
            at = np.array([column for column, group in zip(self.columns, self.group, strict=True) if group == i], int)
            found, depth = sensordata[..., at], -sensordata[..., at + 1]
            touch = (found > 0) & (depth >= 0)
            out.append(xp.max(xp.where(touch, depth, -np.inf), axis=-1, initial=-np.inf))
        return xp.stack(out, axis=-1) if out else xp.full((*sensordata.shape[:-1], 0), -np.inf)
