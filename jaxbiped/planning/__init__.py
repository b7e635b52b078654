"""Grid to graph costs, cost-to-go field and path; the reference A*."""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(
    __name__,
    {
        "reference_astar": "AStarPath astar",
        "costs": "BASE_PITCH DIRECTIONS Costs Rules edge_costs",
        "cost_field": "CostToGo cost_to_go field",
        "gradient": "MoveCounts move_counts path_cost",
        "heading": "HeadingField Moves Times heading_field heading_moves heading_path path_time",
        "path": "Path next_step read_path",
        "path_search": "PathSearch ShortestPath shortest_path",
    },
)
