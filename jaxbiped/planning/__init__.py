"""Grid to graph costs, cost-to-go field and path; the reference A*."""

from jaxbiped.planning.astar import AStarPath, astar
from jaxbiped.planning.costs import BASE_PITCH, DIRECTIONS, Costs, Rules, edge_costs
from jaxbiped.planning.field import CostToGo, cost_to_go, field
from jaxbiped.planning.gradient import MoveCounts, move_counts, path_cost
from jaxbiped.planning.path import Path, next_step, read_path

__all__ = [
    "BASE_PITCH",
    "DIRECTIONS",
    "AStarPath",
    "CostToGo",
    "Costs",
    "MoveCounts",
    "Path",
    "Rules",
    "astar",
    "cost_to_go",
    "edge_costs",
    "field",
    "move_counts",
    "next_step",
    "path_cost",
    "read_path",
]
