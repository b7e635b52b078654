"""Sensors that work on the host, for missions that are stepped there: each robot's view, measured one by one."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import jax
import numpy as np
from jaxtyping import Array, Float, UInt32

from jaxbiped.arenas.arena import Arena
from jaxbiped.mission.cycle import SENSE
from jaxbiped.mission.settings import MissionConfig, Settings
from jaxbiped.mission.state import Carriage, Mind, World
from jaxbiped.sensing.camera import CameraConfig, Mount, mount, placed
from jaxbiped.sensing.hashing import fold
from jaxbiped.sensing.noise import attitude_error
from jaxbiped.sensing.shot import Shot
from jaxbiped.sensing.view import Sightings, View

RENDERED = ("stereo",)  # sensors that are no JAX


@runtime_checkable
class Eyes(Protocol):
    """What robots that are stepped on the host see with."""

    def see(
        self,
        world: World,
        mind: Mind,
        arena: Arena,
        settings: Settings,
        carriage: Carriage | None = None,
        count: int | None = None,
    ) -> tuple[View, Sightings]:
        """What each robot of a batch measures, as `cycle.sense` does: the same places, attitudes and seeds.

        Args:
          carriage: [B] how each robot really holds its body; None: upright, but for a tilt that is drawn.
          count: rows from this one on are padding, and may get anything.
        """
        ...

    def picture(self) -> Shot | None:
        """What the last measurement looked like; None where there is no picture."""
        ...


class StereoEyes:
    """The sensor `stereo` for the robots of one process; to be used, and closed, in the thread that made it."""

    def __init__(self, camera: CameraConfig):
        """
        Raises:
          InputError: nothing can be rendered on this machine.
        """
        from jaxbiped.sensing.stereo.measure import StereoSensor  # loads MuJoCo, and how it renders

        self.sensor = StereoSensor(camera)
        self.last: Shot | None = None

    def see(
        self,
        world: World,
        mind: Mind,
        arena: Arena,
        settings: Settings,
        carriage: Carriage | None = None,
        count: int | None = None,
    ) -> tuple[View, Sightings]:
        """See `Eyes`; padding gets what the last row before it gets."""
        placing = jax.device_get((where(world, mind, settings, carriage), mind.belief.pose, settings.stereo.max_range))
        arena, spread = jax.device_get((arena, settings.landmarks))
        seen = []
        for k in range(count or len(world.code)):
            one, spread_one, (eye, believed, max_range) = jax.tree.map(lambda v, k=k: v[k], (arena, spread, placing))
            origin, basis, at, seed = eye
            self.last = self.sensor(one, origin, basis, at, believed, float(max_range), spread_one, int(seed))
            seen.append((self.last.view, self.last.sightings))
        seen += seen[-1:] * (len(world.code) - len(seen))
        return jax.tree.map(lambda *rows: np.stack(rows), *seen)

    def picture(self) -> Shot | None:
        """See `Eyes`."""
        return self.last

    def close(self) -> None:
        """Free what the graphics driver holds."""
        self.sensor.close()


def eyes_for(config: MissionConfig) -> StereoEyes | None:
    """What a mission of this config sees with on the host; None where its sensor is JAX."""
    return StereoEyes(config.camera) if config.sensor in RENDERED else None


def try_eyes(config: MissionConfig) -> None:
    """Refuse, before anything is printed or written, a sensor that does not work on this machine.

    Raises:
      InputError: nothing can be rendered here.
    """
    if eyes := eyes_for(config):
        eyes.close()


@jax.jit
def where(
    world: World, mind: Mind, settings: Settings, carriage: Carriage | None
) -> tuple[Float[Array, "B 3"], Float[Array, "B 3 3"], Mount, UInt32[Array, "B"]]:
    """Each robot's left camera, truly: its centre [m] and its axes; where it is believed to sit; the view's seed."""

    def one(world, mind, settings, carriage):
        seed = fold(world.seed, SENSE, world.decisions)
        at = mount(settings.camera, mind.look, world.squat)
        if carriage is None:
            return *placed(world.pose, at, *attitude_error(settings.stereo, seed)), at, seed
        return *placed(carriage.pose, at, carriage.roll, carriage.pitch), at, seed

    return jax.vmap(one)(world, mind, settings, carriage)
