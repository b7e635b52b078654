"""Base of executors, which play a command of one arena in the true world inside the compiled loop."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxbiped.core.component import as_component
from jaxbiped.core.names import SIMULATED
from jaxbiped.core.registry import EXECUTORS
from jaxbiped.errors import InputError
from jaxbiped.geometry.pose import Pose
from jaxbiped.motion.config import STEP_TOLERANCE

CHECKS = (1 / 3, 2 / 3, 1.0)  # fractions of its path at which the body is checked against boxes
TOUCH = STEP_TOLERANCE  # [m] contact that is ignored: rounding, and boxes that end exactly at a height
ODOMETRY = 2  # channel of a mission's seed
PLAY = 3  # channel of a mission's seed


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Execution:
    """The outcome of one command."""

    pose: Pose  # true pose afterwards
    moved: Float[Array, "*B 3"]  # dx, dy [m], dyaw [rad] by odometry, in the robot frame before the command
    variances: Float[Array, "*B 3"]  # variances of `moved`
    time: Float[Array, "*B"]  # [s]
    distance: Float[Array, "*B"]  # [m]
    collided: Bool[Array, "*B"]
    fell: Bool[Array, "*B"]
    outside: Bool[Array, "*B"]


class Executor:
    """Base class of executors: a frozen dataclass that is a pytree, like planners. It is written for one robot."""

    places_feet: ClassVar[bool] = False  # default for placing feet by measured edges
    on_terrain: ClassVar[bool] = False  # whether it supports arenas with terrain

    def execute(self, arena: Any, world: Any, command: Any, params: Any) -> Execution:
        """Execute one `Command` in an `Arena`, starting from `WorldState`.

        Noise is a function of `world.seed` and `world.decisions` alone (`core` `fold`): the same for every batch.
        """
        raise NotImplementedError(f"{type(self).__name__} has no method `execute`")


def find_executor(name: str) -> Executor | None:
    """The executor registered under a name, or imported from `package.module:name`; None: a simulated biped.

    Raises:
      InputError: an unknown name, with the known ones; a module that cannot be imported.
    """
    from jaxbiped.executors import built_in  # noqa: F401  registers those that are built in

    return (
        None
        if name in SIMULATED
        else EXECUTORS.find(name, lambda thing, own: as_component(thing, Executor, f"executor {own}"))
    )


WANTED = {"moved": ((3,), "f"), "variances": ((3,), "f"), "time": ((), "f"), "distance": ((), "f")}
WANTED |= {name: ((), "b") for name in ("collided", "fell", "outside")}


def execution_of(executor: Executor, arena: Any, world: Any, command: Any, params: Any) -> Execution:
    """Run an executor's command and check the result. An invalid distance or time becomes a pose that is not finite.

    Raises:
      InputError: a result that is not the execution of one robot.
    """
    made = executor.execute(arena, world, command, params)
    where = f"executor {type(executor).__name__}"
    if not isinstance(made, Execution):
        raise InputError("its execute must return an Execution", field=where, value=type(made).__name__)
    parts = {name: (getattr(made, name), *wanted) for name, wanted in WANTED.items()}
    parts |= {f"pose.{name}": (getattr(made.pose, name), (), "f") for name in ("x", "y", "z", "yaw")}
    for name, (value, shape, kind) in parts.items():
        found = jnp.shape(value), np.dtype(jnp.result_type(value)).kind
        if found != (shape, kind):
            wanted = f"{'truth values' if kind == 'b' else 'real numbers'} of shape {list(shape)}"
            message = f"gave {jnp.result_type(value)}{list(found[0])} where {wanted} are required"
            raise InputError(message, field=f"{where}: {name}")
    from jaxbiped.executors.built_in import Kinematic, Sampled

    if type(executor) in (Kinematic, Sampled):
        return made
    sane = jnp.isfinite(made.distance + made.time + made.pose.z) & (made.distance >= 0) & (made.time >= 0)
    pose = replace(made.pose, x=jnp.where(sane, made.pose.x, jnp.nan))  # ends the mission as `invalid`
    distance, time = (jnp.where(sane, value, 0.0) for value in (made.distance, made.time))
    return replace(made, pose=pose, distance=distance, time=time)
