"""Grid to graph costs, cost-to-go field and path; the reference A*."""

from jaxbiped.planning.astar import AStarPath, astar
from jaxbiped.planning.costs import BASE_PITCH, DIRECTIONS, Costs, Rules, edge_costs
from jaxbiped.planning.field import CostToGo, cost_to_go, field
from jaxbiped.planning.gradient import MoveCounts, move_counts, path_cost
from jaxbiped.planning.heading import HeadingField, Moves, Times, heading_field, heading_moves, heading_path, path_time
from jaxbiped.planning.path import Path, next_step, read_path

__all__ = [
    "BASE_PITCH",
    "DIRECTIONS",
    "AStarPath",
    "CostToGo",
    "Costs",
    "HeadingField",
    "MoveCounts",
    "Moves",
    "Path",
    "Rules",
    "Times",
    "astar",
    "cost_to_go",
    "edge_costs",
    "field",
    "heading_field",
    "heading_moves",
    "heading_path",
    "move_counts",
    "next_step",
    "path_cost",
    "path_time",
    "read_path",
]
