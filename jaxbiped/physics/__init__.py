"""Batches of simulations of any MJCF, in MuJoCo's own batch or in MJX, behind one protocol."""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(
    __name__,
    {
        "backend": "WARNINGS Backend Rollout State explain",
        "backend_choice": "BACKENDS make",
    },
)
