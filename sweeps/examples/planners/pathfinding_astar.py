"""A* of the library `pathfinding` (pip install pathfinding), on the weights of cells."""

import numpy as np
from pathfinding.core.diagonal_movement import DiagonalMovement
from pathfinding.core.grid import Grid
from pathfinding.finder.a_star import AStarFinder

from jaxbiped import Cell, free_cells


def pathfinding_astar(classes, levels, start_ij, goal_ij, costs):
    """Cells from the start to the goal. A cell weighs what Eq. 1 asks for a straight move on it."""
    motion = np.select([classes == Cell.UNMEASURED, classes == Cell.GATE], [costs.c4, costs.c2], costs.c1)
    weights = np.where(free_cells(classes, levels, start_ij), costs.c0 + motion, 0.0)  # 0: blocked
    grid = Grid(matrix=weights.tolist())
    finder = AStarFinder(diagonal_movement=DiagonalMovement.only_when_no_obstacle)
    start, goal = (grid.node(cell[1], cell[0]) for cell in (start_ij, goal_ij))
    path, _ = finder.find_path(start, goal, grid)
    return [(node.y, node.x) for node in path] or None
