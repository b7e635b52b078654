"""A map of whatever a cloud of points covers: one look, or a whole scan, on a grid laid out for it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Float32, Int64

from jaxbiped.core.class_grid import ClassGrid
from jaxbiped.errors import InputError
from jaxbiped.geometry.pose import Pose
from jaxbiped.mapping.config import ONE_LOOK as ONE_LOOK
from jaxbiped.mapping.config import SCAN as SCAN
from jaxbiped.mapping.config import ChartConfig as ChartConfig
from jaxbiped.mapping.cover import Slices, chunks, cover_slices
from jaxbiped.mapping.grid import MOST_CELLS, Body, Cell, GridSpec
from jaxbiped.mapping.gridmap import classify, empty, update
from jaxbiped.mapping.roofs import cover_above, find_roofs
from jaxbiped.sensing.view import View

COVERED = 12.5  # [cm2] of 5 x 5 cm that a scan is taken to cover; sparser ones count for more


@dataclass(frozen=True)
class Chart:
    """The 3D grid and the 2D grid of one cloud."""

    grid: ClassGrid
    surface: Float32[np.ndarray, "H W Z"]  # [cm2] seen in each voxel
    spec: GridSpec  # its cell (0, 0) has its outer corner at `grid.origin_xy`


def lay_out(
    points: Float[np.ndarray, "N 3"],
    pitch: float,
    *,
    heights: tuple[float, float] = (-0.045, 0.5),
    area: tuple[float, float, float, float] | None = None,
) -> tuple[GridSpec, tuple[float, float]]:
    """A grid that holds all points whose height [m] is within `heights`, and the place of its corner (x, y) [m].

    Borders are whole multiples of the pitch.

    Args:
      points: [m] z up, the floor at 0.
      pitch: [m] side of a cell.
      heights: [m] what is lower or higher is of no interest.
      area: (least x, greatest x, least y, greatest y) [m] in place of what the points cover.

    Raises:
      InputError: no point is that near to the floor; an empty area, or one of too many cells.
    """
    if area is None:
        low = np.array([np.inf, np.inf])
        high = -low
        for some in chunks(len(points)):
            part = points[some]
            part = part[(part[:, 2] > heights[0]) & (part[:, 2] < heights[1])]
            if len(part):
                low, high = np.minimum(low, part[:, :2].min(0)), np.maximum(high, part[:, :2].max(0))
        if not np.isfinite(low).all():
            message = f"must hold points from {heights[0]:g} to {heights[1]:g} m over the floor; none is there"
            raise InputError(message, field="cloud")
    else:
        low, high = np.array(area[0::2], float), np.array(area[1::2], float)
        if not (np.isfinite([low, high]).all() and (low < high).all()):
            raise InputError("must be finite, X0 < X1 and Y0 < Y1", field="area", value=area)
    first = np.floor(low / pitch + 1e-9)
    cells = np.maximum(np.ceil(high / pitch - 1e-9) - first, 1)
    if area is None:
        cells = np.floor(high / pitch + 1e-6) - first + 1  # a point on the upper border is inside
    if not cells.prod() <= MOST_CELLS:
        wide, deep = cells * pitch
        message = (
            f"must give at most {MOST_CELLS:,} cells on the {wide:.6g} x {deep:.6g} m of the cloud; "
            "a larger --pitch or a smaller --area does (and --scale, where the cloud is not in metres)"
        )
        raise InputError(message, field="pitch", value=pitch)
    columns, rows = (int(n) for n in cells)
    spec = GridSpec(size_x=columns * pitch, size_y=rows * pitch, pitch=pitch)
    return spec, (float(first[0] * pitch), float(first[1] * pitch))


def make_chart(
    points: Float[np.ndarray, "N 3"],
    spec: GridSpec,
    origin_xy: tuple[float, float],
    body: Body,
    config: ChartConfig,
    *,
    sparse: bool = False,
) -> Chart:
    """The map of one cloud, by the rules of `mapping.update` and `mapping.classify` as for one view.

    What counts is the surface that points cover, not their number: one look holds a hundred times as many pixels near
    by as far off, and a scan has a density of its own. With pixels, a threshold that keeps phantoms out near by leaves
    walls out far off. And a cell is floor, bump or gate only where its ground was seen: with one look there is no other
    that would tell of what stands below a table. What was seen from above, with nothing below it, is filled down to the
    floor (`find_roofs`).

    Args:
      points: [m] z up, the floor at 0; any number of them, finite or not.
      spec, origin_xy: the grid (`lay_out`).
      body: the robot that it is read for.
      config: thresholds: `ONE_LOOK`, `SCAN`, or others.
      sparse: count surfaces for more where the cloud is so sparse that it covers less than half of a typical cell.
    """
    slices = cover_slices(points, spec, origin_xy)
    shape = (*spec.shape, spec.levels)
    surface = np.bincount(slices.voxel, slices.surface, np.prod(shape)).astype(np.float32).reshape(shape)
    scale = 1.0
    if sparse and surface.any():
        best = surface.max(-1)
        scale = max(COVERED * spec.cell_share / float(np.median(best[best > 0])), 1.0)
    evidence, least = surface * scale, config.voxel * spec.cell_share
    above = cover_above(points, spec, origin_xy) * scale
    solid = find_roofs(evidence, above, least, config.solid * spec.cell_share, spec)
    view = points_of(slices, scale, np.flatnonzero(solid), config.solid + least, spec)
    classes, levels = (np.array(values) for values in read(view, body, config.params(), spec=spec))
    ground = evidence[..., : spec.ground_levels - spec.lowest].sum(-1)
    unseen = (ground < least) & (classes != Cell.OBSTACLE)
    classes[unseen], levels[unseen] = Cell.UNMEASURED, 0
    grid = ClassGrid(classes, levels, np.array(origin_xy, np.float64), spec.pitch)
    return Chart(grid, surface, spec)


def points_of(slices: Slices, scale: float, filled: Int64[np.ndarray, "m"], weight: float, spec: GridSpec) -> View:
    """A view of one point for each slice that was seen, at its mean height, and one for each voxel that is filled.

    Args:
      scale: of the surfaces; `filled` are indices into a flat grid, and `weight` is that of each.
    """
    voxel = np.concatenate([slices.voxel, filled])
    i, j, k = np.unravel_index(voxel, (*spec.shape, spec.levels))
    middle, reach = (k + spec.lowest) * spec.level_height, 0.499 * spec.level_height
    z = np.concatenate([slices.height, middle[len(slices.voxel) :]])
    slots = 1 << max(len(voxel) - 1, 1).bit_length()  # powers of two, so that few sizes are ever compiled
    padded = np.zeros((4, slots), np.float32)
    padded[:, : len(voxel)] = (
        (j + 0.5) * spec.pitch,
        (i + 0.5) * spec.pitch,
        np.clip(z, middle - reach, middle + reach),  # a mean may lie a rounding error beyond its voxel
        np.concatenate([slices.surface * scale, np.full(len(filled), weight)]),
    )
    return View(*padded)


@partial(jax.jit, static_argnames="spec")
def read(view, body, params, *, spec):
    """Classes and levels of one view from the grid's corner."""
    here = Pose(*(jnp.float32(0),) * 4)
    nothing = empty(spec)
    first = update(nothing, view, here, body, params, spec, refit=False).surfaces
    # Heights in a second look: the first has told what is a top, and what is the face below it.
    known = replace(nothing, surfaces=jax.tree.map(lambda leaf: leaf * 1e-3, first))
    return classify(update(known, view, here, body, params, spec, refit=False), params, spec)
