"""Roofs: surfaces that were seen only from above, with nothing below them. They are solid down to the floor."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Float32
from scipy import ndimage

from jaxbiped.mapping.cover import cover_voxels
from jaxbiped.mapping.grid import GridSpec

FLAT = 2  # levels of a column that a flat surface fills at most, with its noise


def cover_above(
    points: Float[np.ndarray, "N 3"], spec: GridSpec, origin_xy: tuple[float, float]
) -> Float32[np.ndarray, "H W"]:
    """Surface [cm2] in plan that was seen above the highest level of the grid, in each cell."""
    top = (spec.levels + spec.lowest - 1) * spec.level_height
    with np.errstate(invalid="ignore"):
        high = np.array(points[points[:, 2] >= top + spec.level_height / 2])
    high[np.isfinite(high[:, 2]), 2] = top
    return cover_voxels(high, spec, origin_xy)[..., -1]


def find_roofs(
    evidence: Float32[np.ndarray, "H W Z"],
    above: Float32[np.ndarray, "H W"],
    least: float,
    wide: float,
    spec: GridSpec,
) -> Bool[np.ndarray, "H W Z"]:
    """The voxels from the floor up to surfaces that were seen from above, with nothing seen below them.

    Such is a flat surface (at most `FLAT` levels of a column) that hides the ground: what is seen with ground below it
    in the middle, as a table, a lintel or a ceiling is, hangs, and so does all of it that lies in one piece.

    Args:
      evidence: [cm2] in each voxel, `above` [cm2] higher than the grid.
      least: [cm2] that counts as something seen; `wide` [cm2] as a surface, and not what leaks from the next cell.
    """
    seen = np.concatenate([evidence, above[..., None]], axis=-1) >= least
    grounds, count = spec.ground_levels - spec.lowest, seen.shape[-1]
    high = seen[..., grounds:]
    lowest = grounds + high.argmax(-1)
    rows, columns = np.indices(lowest.shape)
    beyond = [seen[rows, columns, np.minimum(lowest + k, count - 1)] & (lowest + k < count) for k in range(FLAT + 1)]
    covered = np.where(lowest < count - 1, evidence[rows, columns, np.minimum(lowest, count - 2)], above)
    surface = high.any(-1) & ~np.logical_and.reduce(beyond) & (covered >= wide)
    ground = (evidence[..., :grounds].sum(-1) >= least) & surface
    piece, pieces = ndimage.label(surface, np.ones((3, 3)))
    inner = ndimage.binary_erosion(surface, np.ones((3, 3)))
    inner |= ~np.isin(piece, piece[inner])  # a narrow piece has no middle: all of it counts
    numbers = np.arange(1, pieces + 1)
    hangs = np.zeros(pieces + 1, bool)
    hangs[1:] = ndimage.sum(ground & inner, piece, numbers) > ndimage.sum(inner, piece, numbers) / 2
    roof = surface & ~ground & ~hangs[piece]
    levels = np.arange(evidence.shape[-1])
    return roof[..., None] & (levels >= -spec.lowest) & (levels <= lowest[..., None])
