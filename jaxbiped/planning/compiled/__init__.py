"""Planners compiled by Numba for a CPU, as functions of JAX arrays and of NumPy arrays.

Numba loads at the first use.
"""

from jaxbiped.core.lazy_package import lazy_package

lazy_package(
    __name__,
    {
        "crossing": "crossing_faces",
        "heading": "settle_headings",
        "names": "LANES METHODS",
        "settle": "aligned settle settle_arrays settle_grids",
    },
)
