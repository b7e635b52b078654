"""Planners compiled by Numba for a CPU, as functions of JAX arrays and of NumPy arrays."""

from jaxbiped.planning.compiled.crossing import crossing_faces
from jaxbiped.planning.compiled.heading import solve_headings
from jaxbiped.planning.compiled.line_sweep import LANES
from jaxbiped.planning.compiled.solvers import METHODS, aligned, solve_arrays, solve_edges, solve_grids

__all__ = [
    "LANES",
    "METHODS",
    "aligned",
    "crossing_faces",
    "solve_arrays",
    "solve_edges",
    "solve_grids",
    "solve_headings",
]
