"""Planners compiled by Numba for a CPU, as functions of JAX arrays."""

from jaxbiped.planning.compiled.settle import METHODS, settle, settle_grids

__all__ = ["METHODS", "settle", "settle_grids"]
