"""Sensors that measure inside the compiled loop: the built-in ones, and the base class of users' own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, UInt32

from jaxbiped.core.component import as_component
from jaxbiped.core.registry import SENSORS
from jaxbiped.errors import InputError
from jaxbiped.geometry.pose import Pose
from jaxbiped.mission.config import RENDERED
from jaxbiped.sensing import oracle, raycast
from jaxbiped.sensing.view import View

ORACLE_SPACING = (
    0.02  # [m] spacing of the oracle's columns of points, or the cells' pitch if smaller; thinner walls are missed
)
ORACLE_WEIGHT = 256.0  # [px] of each of its points: enough to count as solid alone


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Standpoint:
    """The viewpoint of one robot, and how it measures."""

    pose: Pose  # the true one; z is the height of the ground under the robot
    looks_down: Bool[Array, "*B"]  # its camera is tilted to the feet
    squat: Bool[Array, "*B"]
    attitude: tuple[Float[Array, "*B"], Float[Array, "*B"]] | None  # [rad] true roll and pitch; None: not known
    seed: UInt32[Array, "*B"]  # of this measurement's noise


class Sensor:
    """Base class of sensors: a frozen dataclass that is a pytree, like planners. It is written for one robot."""

    knows_pose: ClassVar[bool] = False  # whether the robot knows its pose, and its points are level
    on_terrain: ClassVar[bool] = False  # whether it supports arenas with terrain
    is_picture: ClassVar[bool] = False  # whether its points are those of the camera's rays, row by row

    def measure(self, arena: Any, at: Standpoint, params: Any, spec: Any) -> View:
        """Points in the robot frame of one `Arena`.

        Args:
          params: `params.camera`, `params.stereo` and so on, traced.
          spec: static values: `spec.image` (the camera's rays), `spec.grid` (the map).

        Numbers that are not finite end the mission as `invalid`.
        """
        raise NotImplementedError(f"{type(self).__name__} has no method `measure`")


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class RayCast(Sensor):
    """True depth, as a stereo matcher would measure it; see `sensing.raycast`."""

    on_terrain, is_picture = True, True

    def measure(self, arena: Any, at: Standpoint, params: Any, spec: Any) -> View:
        """See `Sensor`."""
        camera, stereo = params.camera, params.stereo
        return raycast.measure(
            arena, at.pose, camera, stereo, spec.image, at.seed, at.looks_down, at.squat, at.attitude
        )


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Oracle(Sensor):
    """The complete true arena, and the true pose; see `sensing.oracle`."""

    knows_pose, on_terrain = True, True

    def measure(self, arena: Any, at: Standpoint, params: Any, spec: Any) -> View:
        """See `Sensor`."""
        area = (spec.grid.size_x, spec.grid.size_y)
        spacing, levels = min(ORACLE_SPACING, spec.grid.pitch), spec.grid.levels + spec.grid.lowest
        return oracle.measure(arena, at.pose, area, spacing=spacing, levels=levels, weight=ORACLE_WEIGHT)


BUILT_IN = {"raycast": RayCast(), "oracle": Oracle()}
for _name, _sensor in BUILT_IN.items():
    SENSORS.add(_name, _sensor)


def find_sensor(name: str) -> Sensor | None:
    """The sensor registered under a name, or imported from `package.module:name`; None: on the host.

    Raises:
      InputError: an unknown name, with the known ones; a module that cannot be imported.
    """
    return (
        None
        if name in RENDERED
        else SENSORS.find(name, lambda thing, own: as_component(thing, Sensor, f"sensor {own}"))
    )


def view_of(sensor: Sensor, arena: Any, at: Standpoint, params: Any, spec: Any) -> View:
    """A sensor's measurement, checked if it is not built in; values that are not finite make all weights NaN.

    Raises:
      InputError: a result that is not the view of one robot.
    """
    view = sensor.measure(arena, at, params, spec)
    if type(sensor) in (RayCast, Oracle):
        return view
    where = f"sensor {type(sensor).__name__}"
    if not isinstance(view, View):
        raise InputError("its measure must return a View", field=where, value=type(view).__name__)
    shapes = [jnp.shape(leaf) for leaf in jax.tree.leaves(view)]
    if len(set(shapes)) != 1 or len(shapes[0]) != 1 or shapes[0][0] == 0:
        said = ", ".join(str(list(shape)) for shape in shapes)
        raise InputError(f"gave x, y, z and weight of the shapes {said} where [N] is required for all", field=where)
    view = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), view)
    fine = jnp.isfinite(view.x + view.y + view.z + view.weight) & (view.weight >= 0)
    clean = jax.tree.map(lambda leaf: jnp.where(fine, leaf, 0.0), view)
    return replace(clean, weight=jnp.where(jnp.all(fine), clean.weight, jnp.nan))
