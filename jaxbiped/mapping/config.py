"""What may be chosen of the map. Light to import: arrays are made, and JAX is loaded, when they are asked for."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from pydantic import Field

from jaxbiped.config import Model

if TYPE_CHECKING:
    from jaxbiped.mapping.params import MapParams


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
    """a voxel with a smaller share of the points of one right above or below is empty: noise leaked out of that one;
    and a patch of 5 x 5 cm with a smaller share of those of one within 5 cm, one level higher or lower, bars no way:
    it is a mixture at the edge of that one"""
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
        import jax.numpy as jnp

        from jaxbiped.mapping.params import MapParams

        given = self.model_dump() | {"fade": math.inf if self.fade is None else self.fade}
        return MapParams(**{name: jnp.float32(value) for name, value in given.items() if value is not None})


class ChartConfig(Model):
    """Thresholds on the surface that points cover, as those of `MapConfig` on numbers of pixels.

    They are stated for cells of 5 x 5 cm, and scale with the cell's area (`solid` belongs to a patch of fixed size).
    """

    voxel: float = Field(0.25, ge=0)
    """[cm2] a voxel with less is empty"""
    voxel_share: float = Field(0.05, ge=0, lt=1)
    """a voxel with a smaller share of the surface of one right above or below is empty: noise leaked out of that one;
    and a patch of 5 x 5 cm with a smaller share of that of one within 5 cm, one level higher or lower, bars no way"""
    solid: float = Field(6.0, ge=0)
    """[cm2] a patch of 5 x 5 cm of one level with less bars no way: it may be a phantom; a face of a wall has 15"""
    cell: float = Field(1.25, gt=0)
    """[cm2] a cell with less is unmeasured"""
    head_margin: float = Field(0.0, ge=0)
    """[m] how far a voxel may reach below the squatting head before it blocks"""
    height_sd: float = Field(0.0025, ge=0)
    """[m] to which 1 cm2 tells the height of a surface; n cm2, to a root of n less"""

    def params(self) -> MapParams:
        """These thresholds for `mapping.update`, to which a point then weighs what it covers."""
        import jax.numpy as jnp

        from jaxbiped.mapping.params import MapParams

        named = {"voxel_points": self.voxel, "voxel_share": self.voxel_share, "solid_points": self.solid}
        named |= {"fused_points": self.cell, "head_margin": self.head_margin, "height_sd": self.height_sd}
        named |= dict.fromkeys(("max_range", "height_range", "fade"), math.inf)
        unused = ("view_points", "refit_slope", "refit_offset", "refit_inlier", "refit_points", "height_margin")
        return MapParams(**{name: jnp.float32(value) for name, value in (named | dict.fromkeys(unused, 0.0)).items()})


ONE_LOOK, SCAN = ChartConfig(solid=12.5), ChartConfig()
"""For one stereo pair, whose phantoms must not bar the way, and for a scan, which has none.

By rendered pairs of 36 random arenas, and by clouds sampled from 12 at densities of 4 to 70 points a cell.
"""
