"""`jaxbiped classify --heightmap`: the class grid of an elevation map, for a robot that walks on it."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float64

from jaxbiped.commands.charting import say_cells, write_json
from jaxbiped.core import class_grid
from jaxbiped.errors import InputError
from jaxbiped.files import new_folder
from jaxbiped.formats.elevation import Elevation, load_elevation, save_elevation
from jaxbiped.mapping.grid import MOST_CELLS, MOST_GROUNDS, GridSpec
from jaxbiped.mapping.truth import terrain_grid
from jaxbiped.motion.config import RobotConfig
from jaxbiped.terminal import legible

if TYPE_CHECKING:
    from jaxbiped.commands.classify import ClassifyArgs

LEVELS = 32  # the number of bits in a mask of levels
LOWEST = 0.01  # share of heights that may lie below the base floor, as errors


def main(args: ClassifyArgs, out: Path) -> int:
    """Run the command.

    Returns:
      Exit status 0.

    Raises:
      InputError: an unusable map, options that do not go with a map or with each other, a folder that exists or
        cannot be written.
    """
    check_options(args)
    start = time.perf_counter()
    elevation = load_elevation(args.cloud, cell=args.cell, range=args.range, hole=args.hole, scale=args.scale)
    floor = base_height(elevation, args.robot) if args.floor is None else args.floor
    grid = classify(elevation, floor, args.pitch, args.robot, args.area)
    seconds = time.perf_counter() - start
    low, high = float(np.nanmin(elevation.heights)), float(np.nanmax(elevation.heights))
    with new_folder(out) as folder:
        from jaxbiped.report import measured  # loads matplotlib

        title = legible(args.cloud.name)
        class_grid.save(grid, folder / "classes.npz")
        save_elevation(elevation, folder / "elevation.npz")
        measured.save_elevation(
            folder / "elevation.png", elevation.heights, elevation.origin_xy, elevation.pitch, title
        )
        measured.save_classes(folder / "map.png", grid, title=title)
        summary = {
            "config": args.model_dump(mode="json"),
            "heights": list(elevation.heights.shape),
            "holes": elevation.holes,
            "lowest": low,
            "highest": high,
            "floor": floor,
            "floor_found": args.floor is None,
            "walls_from": floor + (MOST_GROUNDS - 0.5) * args.robot.step,
            "level_height": args.robot.step,
        }
        write_json(folder / "classify.json", summary)
    rows, columns = elevation.heights.shape
    wide, deep = elevation.size_xy
    holes = f"; {elevation.holes} are holes" if elevation.holes else ""
    print(f"heights   {args.cloud}: {columns} x {rows}, {wide:.3g} x {deep:.3g} m, {low:.3f} to {high:.3f} m{holes}")
    found = "found" if args.floor is None else "given"
    print(f"floor     {found}: {floor:.3f} m; a level is a step, {args.robot.step:g} m")
    above = (MOST_GROUNDS - 0.5) * args.robot.step
    walls = float(np.mean(elevation.heights > floor + above))  # NaN compares false
    if walls:
        print(f"walls     {walls:.1%} of the heights lie more than {above:.3g} m above the floor, and count as walls")
    print(f"map       {say_cells(grid)}, in {seconds:.1f} s")
    print(f"written   {out}: classes.npz, elevation.npz, elevation.png, map.png, classify.json")
    return 0


def check_options(args: ClassifyArgs) -> None:
    """Raise `InputError` about options that apply to clouds only."""
    for name in ("up", "tilt", "map"):
        value = getattr(args, name)
        if value != type(args).model_fields[name].default:
            shown = value if name != "map" else None
            raise InputError("goes with clouds only, not with --heightmap", field=name, value=shown)


def base_height(elevation: Elevation, robot: RobotConfig) -> float:
    """Height [m] of the base floor: the most common height, to the robot's tolerance, within half a step of the lowest.

    The lowest percent is left out: such heights are errors, or a floor that hardly anything stands on.
    """
    known = np.sort(elevation.heights[np.isfinite(elevation.heights)])
    low = known[int(LOWEST * len(known))]
    some = known[(known >= low) & (known <= low + robot.step / 2)]
    width = max(robot.height_tolerance, 1e-6)
    bins = np.floor((some - low) / width)
    values, counts = np.unique(bins, return_counts=True)
    return float(np.median(some[bins == values[counts.argmax()]]))


def classify(
    elevation: Elevation,
    floor: float,
    pitch: float,
    robot: RobotConfig,
    area: tuple[float, float, float, float] | None = None,
) -> class_grid.ClassGrid:
    """The class grid of an elevation map; its levels are steps of the robot above `floor` [m].

    Args:
      pitch: [m] side of a cell.
      area: (least x, greatest x, least y, greatest y) [m] instead of all that the heights cover.

    Raises:
      InputError: an empty area, or too many cells.
    """
    (rows, columns), origin_xy = lay_out(elevation, pitch, area)
    spec = GridSpec(
        size_x=columns * pitch,
        size_y=rows * pitch,
        pitch=pitch,
        level_height=robot.step,
        lowest=0,
        levels=LEVELS,
        ground_levels=MOST_GROUNDS,
        max_radius=robot.radius,
    )
    field = elevation.field(floor)
    # in double precision: a map may lie at the other end of the world
    here = jnp.asarray(elevation.origin_xy - origin_xy, jnp.float32)
    classes, levels = jax.jit(partial(terrain_grid, spec=spec))(replace(field, origin_xy=here), body=robot.body())
    return class_grid.ClassGrid(np.array(classes), np.array(levels), origin_xy, pitch)


def lay_out(
    elevation: Elevation, pitch: float, area: tuple[float, float, float, float] | None
) -> tuple[tuple[int, int], Float64[np.ndarray, "2"]]:
    """Rows and columns of a grid, and the position [m] of its corner."""
    if area is None:
        low = elevation.origin_xy.astype(float)
        cells = np.ceil(np.array(elevation.size_xy) / pitch - 1e-6)
    else:
        low, high = np.array(area[0::2], float), np.array(area[1::2], float)
        if not (low < high).all():
            raise InputError("must be X0 < X1 and Y0 < Y1", field="area", value=area)
        cells = np.ceil((high - low) / pitch - 1e-6)
    if not cells.prod() <= MOST_CELLS:
        wide, deep = cells * pitch
        message = f"must give at most {MOST_CELLS:,} cells on {wide:.6g} x {deep:.6g} m; choose a larger --pitch"
        raise InputError(message, field="pitch", value=pitch)
    columns, rows = (max(int(n), 1) for n in cells)
    return (rows, columns), low
