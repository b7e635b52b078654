"""Obstacles grown by the robot's radius, so that a disc can be planned for as a point."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from jaxbiped.core.class_grid import ClassGrid
from jaxbiped.errors import InputError
from jaxbiped.mapping.grid import Cell


def inflate(grid: ClassGrid, radius: float) -> ClassGrid:
    """The C-obstacles of a disc: a cell is an obstacle when a disc at its centre touches the inside of one.

    Only what is known to be an obstacle grows: unmeasured cells stay what they are, and the map's border is no wall.

    Args:
      grid: a map of obstacles as they are.
      radius: [m] of the disc, 0 or more.

    Raises:
      InputError: a radius below 0, or no finite number.
    """
    if not 0 <= radius < math.inf:
        raise InputError("must be finite and 0 m or more", field="radius", value=radius)
    obstacle = grid.classes == Cell.OBSTACLE
    rows, columns = grid.shape
    reach = radius / grid.pitch - 1e-9  # [cells]; a disc that just touches a face is free
    grown = obstacle.copy()
    counts = np.cumsum(np.pad(obstacle, ((0, 0), (1, 0))), axis=1)  # obstacles left of each column border
    for shift in range(min(math.floor(reach + 0.5), rows - 1) + 1):
        gap = max(shift - 0.5, 0.0)  # from the centre to the nearest face of a row `shift` away
        half = min(math.floor(math.sqrt(max(reach**2 - gap**2, 0.0)) + 0.5), columns)
        low = np.clip(np.arange(columns) - half, 0, columns)
        high = np.clip(np.arange(columns) + half + 1, 0, columns)
        near = counts[:, high] > counts[:, low]
        grown[shift:] |= near[: rows - shift]
        grown[: rows - shift] |= near[shift:]
    return replace(grid, classes=np.where(grown, np.int8(Cell.OBSTACLE), grid.classes))
