"""Model fields that differ by simulation, and the values that MuJoCo derives from them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float64, Integer
from mujoco.batch import Batch, SimulationError

from jaxbiped.errors import InputError
from jaxbiped.physics import inputs
from jaxbiped.physics.mjcf_errors import mjcf_problem


class Fields:
    """The fields of a `mujoco.batch.Batch` that are not the model's own in all simulations."""

    def __init__(self, batch: Batch):
        self.batch = batch
        self.written: set[str] = set()

    def write(self, values: Mapping[str, Float64[np.ndarray, "B ..."]], ids: Integer[np.ndarray, "n"]) -> None:
        """Write the rows `ids` of each field, and update all that is derived from them.

        Without the update a box that was moved keeps its old bounding volume, and silently has no contact.
        """
        self.written |= values.keys()
        rows = {name: self.batch.expand(name) for name in values}
        differ = [np.any((rows[name] != value).reshape(len(value), -1), axis=1) for name, value in values.items()]
        ids = ids[np.any(differ, axis=0)[ids]] if differ else ids[:0]
        if not len(ids):
            return
        for name, value in values.items():
            rows[name][ids] = value[ids]
        try:
            self.batch.set_const(ids.astype(np.int32))
        except SimulationError as error:
            said = mjcf_problem(error)
            raise InputError(f"give an impossible model in simulation {error.ids[0]}: {said}", field="fields") from None

    def only(self, values: Mapping[str, Float64[np.ndarray, "B ..."]]) -> None:
        """Make these, and no others, differ from the model's own."""
        own = {name: self.own(name) for name in sorted(self.written - values.keys())}
        self.write({**own, **values}, np.arange(self.batch.nsim))
        self.written = set(values)

    def own(self, name: str) -> np.ndarray:
        """The model's own values of a field, [B, ...]."""
        value = inputs.own(self.batch.model, name)
        return np.broadcast_to(value, (self.batch.nsim, *value.shape))

    def rows(self, name: str) -> np.ndarray:
        """The values of a field, [B, ...], including derived ones."""
        rows = self.batch.expanded(name)
        return self.own(name) if rows is None else rows
