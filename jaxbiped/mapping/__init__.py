"""Points to a classed 2D grid map."""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(
    __name__,
    {
        "cobstacles": "c_obstacles",
        "config": "MapConfig",
        "grid": "Body Cell GridSpec",
        "gridmap": "GridMap classify empty ground_height mark_footprint update",
        "leveling": "level_view",
        "params": "MapParams",
        "truth": "terrain_grid truth_grid",
    },
)
