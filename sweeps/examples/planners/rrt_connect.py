"""RRT-Connect of the Open Motion Planning Library (pip install ompl), for a point in the plane; its path is shortened.

It draws at random, in the order of its calls, so that two studies with it differ.
"""

import numpy as np
from ompl import base, geometric, util
from scipy import ndimage

from jaxbiped import cells_along, free_cells

FINE = 8  # parts of a cell, of which one beside a blocked cell is kept free of the path
SECONDS = 2.0  # for one plan, after which there is none
util.setLogLevel(util.LogLevel.LOG_NONE)


def rrt_connect(classes, levels, start_ij, goal_ij, costs):
    """Cells that the path crosses. Obstacles are all that it knows: gates and edges cost it nothing."""
    free = free_cells(classes, levels, start_ij)
    if not free[goal_ij]:
        return None
    blocked = ndimage.binary_dilation(np.kron(~free, np.ones((FINE, FINE), bool)), np.ones((3, 3), bool))
    space = base.RealVectorStateSpace(2)
    bounds = base.RealVectorBounds(2)
    for axis, size in enumerate(free.shape):
        bounds.setLow(axis, 0.0)
        bounds.setHigh(axis, size - 1e-6)
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)
    setup.setStateValidityChecker(lambda state: not blocked[int(FINE * state[0]), int(FINE * state[1])])
    setup.getSpaceInformation().setStateValidityCheckingResolution(0.5 / FINE / space.getMaximumExtent())
    ends = []
    for i, j in (start_ij, goal_ij):
        state = space.allocState()
        state[0], state[1] = i + 0.5, j + 0.5
        ends.append(state)
    setup.setStartAndGoalStates(*ends)
    setup.setPlanner(geometric.RRTConnect(setup.getSpaceInformation()))
    setup.solve(SECONDS)
    if not setup.haveExactSolutionPath():
        return None
    setup.simplifySolution()
    return cells_along([(state[0], state[1]) for state in setup.getSolutionPath().getStates()])
