"""MJCF to a model that can be stepped in batches, with the contacts that are to be watched."""

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
PREFIX = "watch/"  # of the sensors that watch contacts; they come after the model's own


def load(source: Any, *, free_joint: bool = False, watch: Watches | None = None) -> mujoco.MjModel:
    """Compile a model.

    Args:
      source: the path of an MJCF file, MJCF text, a `mujoco.MjSpec`, or a `mujoco.MjModel`. It is left as it is.
      free_joint: whether the model must have a free joint.
      watch: {name: pairs of geom names}: contacts to be watched. For each pair the model gets a contact sensor, after
        its own ones, so a `mujoco.MjModel` cannot be given.

    Raises:
      InputError: when it cannot be read, parsed or compiled, has no free joint, or lacks a watched geom.
    """
    file = None
    if isinstance(source, mujoco.MjModel):
        if watch:
            raise InputError("contacts are watched in MJCF or a mujoco.MjSpec, not in a compiled model", field="watch")
        model = copy.copy(source)
    else:
        spec, file = read(source)
        add_watches(spec, watch or {})
        try:
            model = spec.compile()
        except ValueError as error:
            raise InputError(f"is no valid model: {mjcf_problem(error)}", file=file) from None
    if free_joint and mujoco.mjtJoint.mjJNT_FREE not in model.jnt_type:
        raise InputError("the model must have a free joint", file=file, field="joint")
    return model


def read(source: Any) -> tuple[mujoco.MjSpec, Path | None]:
    """A specification of the caller's own, and the file that it came from."""
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
    """One contact sensor a pair of geoms: whether they touch, and the least distance."""
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
            sensor.intprm[:3] = REPORT, 1, 1  # what it reports; the nearest; of one contact


@dataclass(frozen=True)
class Watched:
    """Where the sensor data of a model is its own, and where it is of watched contacts."""

    own: int  # leading columns that are the model's own
    columns: tuple[int, ...]  # of each pair: found here, distance in the next
    group: tuple[int, ...]  # of each pair: the index of its watch
    names: tuple[str, ...]

    @classmethod
    def of(cls, model: mujoco.MjModel, watch: Watches) -> Watched:
        """The layout of a model that `load` gave these watches."""
        pairs = [(i, f"{PREFIX}{name}/{k}") for i, name in enumerate(watch) for k in range(len(watch[name]))]
        columns = tuple(int(model.sensor(name).adr[0]) for _, name in pairs)
        return cls(min(columns, default=model.nsensordata), columns, tuple(i for i, _ in pairs), tuple(watch))

    def depths(self, sensordata: Any, xp: ModuleType) -> Any:
        """[..., ns] -> [..., W] m: greatest penetration of each watch's pairs; -inf where none touches.

        `xp` is NumPy or jax.numpy. A contact within a margin but apart is no touch.
        """
        out = []
        for i in range(len(self.names)):
            at = np.array([column for column, group in zip(self.columns, self.group, strict=True) if group == i], int)
            found, depth = sensordata[..., at], -sensordata[..., at + 1]
            touch = (found > 0) & (depth >= 0)
            out.append(xp.max(xp.where(touch, depth, -np.inf), axis=-1, initial=-np.inf))
        return xp.stack(out, axis=-1) if out else xp.full((*sensordata.shape[:-1], 0), -np.inf)
