"""A path on a map, without a mission around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from jaxbiped import planning
from jaxbiped.core.class_grid import ClassGrid
from jaxbiped.errors import InputError
from jaxbiped.planning.costs import Costs, Rules


@dataclass(frozen=True)
class PlannedPath:
    """The path of lowest cost between two cells."""

    cells_ij: Int[np.ndarray, "n 2"]  # from the start to the goal
    points_xy: Float[np.ndarray, "n 2"]  # [m] the cells' centres
    cost: float  # by Eq. 1

    @property
    def length(self) -> float:
        """[m] Length between the centres."""
        return float(np.linalg.norm(np.diff(self.points_xy, axis=0), axis=1).sum())


def plan(
    grid: ClassGrid,
    start_xy: tuple[float, float],
    goal_xy: tuple[float, float],
    costs: Costs | None = None,
    rules: Rules | None = None,
) -> PlannedPath | None:
    """The path of lowest cost by Eq. 1 on a class grid; None if there is none.

    Args:
      start_xy, goal_xy: [m] in the grid's frame.
      costs: costs on a pitch of 5 cm, by default the paper's; they are converted to the grid's pitch.
      rules: allowed moves; by default all except cutting corners.

    Raises:
      InputError: a point outside the map or on an obstacle.
    """
    costs, rules = (costs or Costs()).at_pitch(grid.pitch), rules or Rules()
    cells = [grid.cell_at(xy, name) for name, xy in (("start_xy", start_xy), ("goal_xy", goal_xy))]
    for name, cell in zip(("start_xy", "goal_xy"), cells, strict=True):
        if grid.classes[cell] == planning.costs.Cell.OBSTACLE:
            raise InputError("must not be on an obstacle", field=name, value=list(cell))
    path = planning.shortest_path(grid.classes, grid.levels, costs, rules, start_ij=cells[0], goal_ij=cells[1])
    if path is None:
        return None
    local = (path.cells_ij[:, ::-1] + 0.5) * grid.pitch
    return PlannedPath(path.cells_ij, grid.origin_xy + local @ grid.axes.T, path.cost)
