"""Sensors that are plain functions of NumPy arrays for one robot, called on the host from inside the compiled loop."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped.core.host_callback import host_call
from jaxbiped.errors import InputError
from jaxbiped.mission.sensors import Sensor, Standpoint
from jaxbiped.sensing.view import View

ViewFunction = Callable[..., np.ndarray]
TOLD: set = set()


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class HostSensor(Sensor):
    """A function that measures for one robot.

    `function(arena, pose, looks_down, squat, rng) -> points`:

    - `arena`: an `Arena` of NumPy arrays: `arena.boxes.x`, `arena.size_xy` and so on.
    - `pose`: the true x, y, z [m] and yaw [rad]; z is the height of the ground under the robot.
    - `looks_down`, `squat`: booleans.
    - `rng`: a `numpy.random.Generator`, the same for the same measurement of the same mission.
    - `points`: [n, 3] in the robot frame [m] (x forward, y left, z up from the ground under it), or [n, 4] with the
      number of pixels of each (1 by default); at most as many as `points` of this object.

    A function that raises an error, or returns anything else, ends its mission as `invalid`; the first such error of a
    process is reported on stderr. Arenas have no terrain; moving boxes are at their positions of that moment.
    """

    function: ViewFunction = field(metadata={"static": True})
    points: int = field(default=4096, metadata={"static": True})

    def __post_init__(self):
        if not callable(self.function):
            raise InputError("must be a function", field="HostSensor", value=self.function)
        if not isinstance(self.points, int) or not 1 <= self.points <= 1_000_000:
            raise InputError("must be 1 to 1000000", field="HostSensor: points", value=self.points)

    def measure(self, arena: Any, at: Standpoint, params: Any, spec: Any) -> View:
        """See `Sensor`."""
        leaves, structure = jax.tree.flatten(arena)
        shapes = [jnp.shape(leaf) for leaf in leaves]
        pose = jnp.stack([at.pose.x, at.pose.y, at.pose.z, at.pose.yaw]).astype(jnp.float32)
        call = caller(
            self.function, self.points, structure, tuple(shapes), tuple(leaf.dtype == bool for leaf in leaves)
        )
        (columns,) = host_call(
            call,
            [jax.ShapeDtypeStruct((4, self.points), np.float32)],
            pose,
            jnp.asarray(at.looks_down, bool),
            jnp.asarray(at.squat, bool),
            jnp.asarray(at.seed, jnp.uint32),
            *(jnp.asarray(leaf, jnp.float32) for leaf in leaves),
            vmap_method="broadcast_all",
        )
        return View(*columns)


CALLERS: dict = {}


def caller(function: ViewFunction, points: int, structure, shapes: tuple, flags: tuple) -> Callable:
    """The function that the compiled program calls, for any batch axes; the same one for the same arguments."""
    key = function, points, structure, shapes, flags
    if key not in CALLERS:

        def call(pose, looks_down, squat, seed, *leaves):
            lead = pose.shape[:-1]
            count = int(np.prod(lead, dtype=int))
            rows = [leaf.reshape(count, *shape) for leaf, shape in zip(leaves, shapes, strict=True)]
            out = np.zeros((count, 4, points), np.float32)
            at = zip(pose.reshape(count, 4), looks_down.ravel(), squat.ravel(), seed.ravel(), strict=True)
            for k, (where, looks, squats, number) in enumerate(at):
                own = [row[k] > 0 if flag else row[k].copy() for row, flag in zip(rows, flags, strict=True)]
                rng = np.random.default_rng(int(number))
                place = tuple(map(float, where))
                seen = structure.unflatten(own), place, bool(looks), bool(squats), rng
                out[k] = measured(function, points, seen)
            return (out.reshape(*lead, 4, points),)

        CALLERS[key] = call
    return CALLERS[key]


def measured(function: ViewFunction, points: int, arguments: tuple) -> np.ndarray:
    """Columns x, y, z and weight [4, points] of one measurement with these arguments; NaN if the function failed."""
    columns = np.zeros((4, points), np.float32)
    try:
        made = np.asarray(function(*arguments), dtype=np.float32)
        if made.ndim != 2 or made.shape[1] not in (3, 4) or len(made) > points:
            raise ValueError(f"must return points [n, 3] or [n, 4], n at most {points}, not {list(made.shape)}")
        columns[3, : len(made)] = 1.0
        columns[: made.shape[1], : len(made)] = made.T
    except Exception as error:
        if function not in TOLD:
            TOLD.add(function)
            place, name = traceback.extract_tb(error.__traceback__)[-1], getattr(function, "__qualname__", "function")
            said = f"{type(error).__name__}: {' '.join(str(error).split())} ({place.name}, line {place.lineno})"
            print(f"jaxbiped: warning: sensor {name}: {said}", file=sys.stderr)
        columns[:] = np.nan
    return columns
