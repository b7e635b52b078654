"""Shared by `stereo` and `classify`: from upright points to a map, its files and its pictures."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from jaxtyping import Float

from jaxbiped.commands.options.charting import ChartArgs
from jaxbiped.core import class_grid
from jaxbiped.files import write_whole
from jaxbiped.mapping.grid import Cell
from jaxbiped.mapping.scan_map import Chart, lay_out, make_chart


def chart(
    points: Float[np.ndarray, "N 3"], args: ChartArgs, away_xy: tuple[float, float] = (0.0, 0.0), sparse: bool = False
) -> Chart:
    """Map upright points; (x, y) = `away_xy` [m] is the position of their origin on the map."""
    area = None
    if args.area is not None:
        area = tuple(side - away_xy[k // 2] for k, side in enumerate(args.area))
    spec, origin_xy = lay_out(points, args.pitch, area=area)
    made = make_chart(points, spec, origin_xy, args.robot.body(), args.map, sparse=sparse)
    grid = made.grid
    moved = class_grid.ClassGrid(grid.classes, grid.levels, grid.origin_xy + np.array(away_xy, float), grid.pitch)
    return Chart(moved, made.surface, made.spec)


def say_cells(grid: class_grid.ClassGrid) -> str:
    """The size of a map and its cells, as text."""
    rows, columns = grid.shape
    count = {cell.name.lower(): int((grid.classes == cell).sum()) for cell in Cell}
    cells = ", ".join(f"{number} {name}" for name, number in count.items() if number)
    return f"{columns} x {rows} cells of {grid.pitch:g} m ({cells})"


def write_chart(
    made: Chart, folder: Path, args: ChartArgs, title: str, camera_xy: tuple[float, float] | None = None
) -> list[str]:
    """Fill a folder with the 2D grid, the 3D grid and their pictures; return the names of the files."""
    from jaxbiped.report import measured  # loads matplotlib

    spec = made.spec
    class_grid.save(made.grid, folder / "classes.npz")
    arrays = {
        "surface_cm2": made.surface,
        "origin_xy": made.grid.origin_xy,
        "pitch": spec.pitch,
        "level_height": spec.level_height,
        "lowest": spec.lowest,
    }
    write_whole(folder / "voxels.npz", lambda file: np.savez_compressed(file, **arrays))
    occupied = made.surface >= max(args.map.voxel * spec.cell_share, 1.0)
    measured.save_voxels(folder / "voxels.png", occupied, spec.pitch, spec.level_height, spec.lowest, title=title)
    measured.save_classes(folder / "map.png", made.grid, title=title, camera_xy=camera_xy)
    return ["classes.npz", "voxels.npz", "voxels.png", "map.png"]


def write_json(path: Path, data: dict) -> None:
    """Write `data` as JSON, whole or not at all."""
    write_whole(path, lambda file: file.write((json.dumps(data, indent=2) + "\n").encode()))
