"""The numbers by which points become classes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float
from pydantic import Field

from jaxbiped.config import Model


class MapConfig(Model):
    """Thresholds of the map, with the values found necessary on rendered stereo pairs.

    A number of points is one of pixels of a 512 x 384 image that fall on a cell of 5 x 5 cm; on another pitch it
    scales with the cell's area (but `solid_points` belong to a patch of fixed size).
    """

    max_range: float = Field(2.0, gt=0)
    """[m] points further off, in plan, are dropped: their depth is uncertain by centimetres"""
    voxel_points: float = Field(2.0, ge=0)
    """a voxel with fewer points is empty, in one view and in the fused evidence"""
    voxel_share: float = Field(0.05, ge=0, lt=1)
    """a voxel with a smaller share of the points of one right above or below is empty: noise leaked out of that one"""
    solid_points: float = Field(144.0, ge=0)
    """a patch of 5 x 5 cm of one level with fewer points bars no way: it may be a phantom, a clump of wild disparity;
    three rays of 64 x 64"""
    below_points: float | None = Field(None, ge=0)
    """fewer will do in a voxel that hangs without a gap below one that bars the way: the foot of a wall further off,
    which else would be taken for a gate where only its upper levels have points enough; by default none will (but 50 of
    rendered stereo)"""
    view_points: float = Field(5.0, ge=0)
    """a cell with fewer points in one view gets no vote from it"""
    fused_points: float = Field(10.0, gt=0)
    """a cell with fewer votes from all views is unmeasured"""
    head_margin: float = Field(0.0, ge=0)
    """[m] how far a voxel may reach below the squatting head before it blocks"""
    refit_slope: float = Field(0.06, ge=0)
    """greatest slope of the fitted floor plane (3.4 degrees); a steeper one is no floor, and the view stays as it is"""
    refit_offset: float = Field(0.03, ge=0)
    """[m] greatest height of the fitted floor plane at the robot"""
    refit_inlier: float = Field(0.008, gt=0)
    """[m] a point this near to a level of the fitted floor lies on it"""
    refit_points: float = Field(400.0, ge=0)
    """pixels that must lie on the fitted floor; fewer, and the view stays as it is"""
    height_sd: float = Field(0.011, ge=0)
    """[m] to which one pixel at the robot's feet tells the height of a surface; n pixels, to a root of n less. What may
    be such an error does not make ground too high, or too low, to be stepped on"""
    height_range: float = Field(0.365, gt=0)
    """[m] distance at which that error is a root of 2 greater; further off it grows in proportion. The camera's
    height: a point's error in depth grows as its distance squared, and the part of it that is height falls"""
    height_margin: float = Field(0.0015, ge=0)
    """[m] to which heights are measured at best: ground this near to what the robot does not bear is taken for it"""
    fade: float | None = Field(None, gt=0)
    """[s] after which what a view tells otherwise counts 1/e, for obstacles that move; by default nothing fades"""

    def params(self) -> MapParams:
        """These thresholds as traced numbers."""
        given = self.model_dump() | {"fade": math.inf if self.fade is None else self.fade}
        return MapParams(**{name: jnp.float32(value) for name, value in given.items() if value is not None})


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
