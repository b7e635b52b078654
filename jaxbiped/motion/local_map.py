"""The classed map as local planning reads it: with the robot's place on it."""

from __future__ import annotations

from dataclasses import dataclass, field

import jax
from jaxtyping import Array, Int

from jaxbiped.geometry.pose import Pose
from jaxbiped.mapping.grid import GridSpec


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class LocalMap:
    """The classed map of one robot, and where it believes it stands."""

    classes: Int[Array, "*B H W"]  # `Cell` of each cell
    levels: Int[Array, "*B H W"]  # level of each cell's ground
    ij: Int[Array, "*B 2"]  # the robot's cell
    pose: Pose  # as believed
    grid: GridSpec = field(metadata={"static": True})
