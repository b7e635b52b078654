"""A fixture for the unit tests of other packages: one small deterministic mission."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jaxbiped.api.single_mission import PlayedMission


def tiny_mission(planner: Any = "full") -> PlayedMission:
    """A mission of 40 cm past one block, identical in every run: perfect sensing, nominal steps, no noise.

    With the package's cache warm it takes under two seconds, most of it JAX.

    Args:
      planner: a strategy's name, or a strategy, planner or function of your own.
    """
    import jaxbiped as jb

    still = dict.fromkeys(("forward", "lateral", "yaw_walked", "yaw_turned"), 0.0)
    config = jb.MissionConfig(sensor="oracle", odometry=still)
    return jb.play(tiny_scene(), planner, config)


@cache
def tiny_scene():
    """The arena of `tiny_mission`."""
    import jaxbiped as jb

    block = jb.Box(centre=(0.45, 0.40), size=(0.08, 0.10), top=0.3)
    return jb.to_arena(jb.Scene(name="tiny", size=(0.9, 0.8), start=(0.2, 0.4, 0.0), goal=(0.7, 0.45), boxes=(block,)))
