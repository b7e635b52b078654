"""The protocol of sources of points."""

from __future__ import annotations

from typing import Protocol

from jaxtyping import Array, Bool, UInt32

from jaxbiped.arenas.arena import Arena
from jaxbiped.geometry.pose import Pose
from jaxbiped.sensing.view import View


class Sensor(Protocol):
    """Measures one arena from the robot's true pose.

    The number of points is the same for each call. JAX sensors are pure and are mapped over arenas by the caller;
    others are called by the stepped mission, one robot at a time. `oracle.measure` and `raycast.measure`, with their
    settings filled in, are sensors.
    """

    def __call__(
        self,
        arena: Arena,
        pose: Pose,
        seed: UInt32[Array, ""],
        look: Bool[Array, ""] | bool,
        squat: Bool[Array, ""] | bool,
    ) -> View:
        """One view. `seed` is of this view alone; `look` tilts the camera to the feet; `squat` lowers it."""
        ...
