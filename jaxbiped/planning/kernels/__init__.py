"""Planners compiled by Numba for a CPU, as functions of JAX and of NumPy arrays. Numba loads at the first use."""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(
    __name__,
    {
        "edge_direction": "crossing_faces",
        "heading": "solve_headings",
        "map_astar": "ABANDONED COST_ONLY FOUND",
        "names": "LANES METHODS",
        "solvers": "aligned solve_arrays solve_edges solve_grids solve_maps target",
    },
)
