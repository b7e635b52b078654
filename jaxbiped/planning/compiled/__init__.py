"""Planners compiled by Numba for a CPU, as functions of JAX arrays and of NumPy arrays."""

from jaxbiped.planning.compiled.crossing import crossing_faces
from jaxbiped.planning.compiled.heading import settle_headings
from jaxbiped.planning.compiled.line_sweep import LANES
from jaxbiped.planning.compiled.settle import METHODS, aligned, settle, settle_arrays, settle_grids

__all__ = [
    "LANES",
    "METHODS",
    "aligned",
    "crossing_faces",
    "settle",
    "settle_arrays",
    "settle_grids",
    "settle_headings",
]
