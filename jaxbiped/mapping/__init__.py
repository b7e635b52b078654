"""Points to a classed 2D grid map."""

from jaxbiped.mapping.cobstacles import c_obstacles
from jaxbiped.mapping.grid import Body, Cell, GridSpec
from jaxbiped.mapping.gridmap import GridMap, classify, empty, ground_height, mark_footprint, update
from jaxbiped.mapping.leveling import level_view
from jaxbiped.mapping.params import MapConfig, MapParams
from jaxbiped.mapping.truth import terrain_grid, truth_grid

__all__ = [
    "Body",
    "Cell",
    "GridMap",
    "GridSpec",
    "MapConfig",
    "MapParams",
    "c_obstacles",
    "classify",
    "empty",
    "ground_height",
    "level_view",
    "mark_footprint",
    "terrain_grid",
    "truth_grid",
    "update",
]
