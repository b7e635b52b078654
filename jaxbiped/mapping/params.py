"""The numbers by which points become classes."""

from __future__ import annotations

from dataclasses import dataclass

import jax
from jaxtyping import Array, Float


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class MapParams:
    """`MapConfig` as numbers that a sweep may change without compiling anew. Meaning and units as there."""

    max_range: Float[Array, ""]
    voxel_points: Float[Array, ""]
    voxel_share: Float[Array, ""]
    solid_points: Float[Array, ""]
    view_points: Float[Array, ""]
    fused_points: Float[Array, ""]
    head_margin: Float[Array, ""]
    refit_slope: Float[Array, ""]
    refit_offset: Float[Array, ""]
    refit_inlier: Float[Array, ""]
    refit_points: Float[Array, ""]
    height_sd: Float[Array, ""]
    height_range: Float[Array, ""]
    height_margin: Float[Array, ""]
    fade: Float[Array, ""]
    below_points: Float[Array, ""] | None = None  # None: the rule is left out of the program
