"""Pictures of measurements: the disparity, the 3D grid, and the 2D grid made from it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Float32
from matplotlib import colormaps, patches
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from jaxbiped.core.class_grid import ClassGrid
from jaxbiped.mapping.grid import Cell
from jaxbiped.report.pictures import (
    CENTIMETRES,
    COLOURS,
    INK,
    METRES,
    Axis,
    MapOverlay,
    draw_map,
    hillshade,
    save_figure,
)
from jaxbiped.report.style import own_style

LARGEST_IN_CENTIMETRES = 5.0  # [m] a map beyond this is drawn in metres
MOST_FACES = 60_000  # drawn voxel faces; beyond that, eight voxels are merged into one
LOOK = np.array([0.62, 0.42, -0.66])  # direction of view of the 3D grid: from behind, from the right, and from above
SHADES = (1.0, 0.72, 0.55)  # of the faces that point up, back and right


@own_style()
def save_disparity(
    path: str | Path, left: np.ndarray, value: Float32[np.ndarray, "H W"], valid: Bool[np.ndarray, "H W"]
) -> None:
    """A PNG of the left picture and its disparity [px]; unmeasured pixels are white."""
    height, width = value.shape
    figure = Figure(figsize=(11, 5.5 * height / width + 0.8), layout="constrained")
    first, second = figure.subplots(1, 2)
    first.imshow(left, cmap="gray", vmin=0, vmax=255)
    first.set_title("left picture", fontsize=10)
    limits = np.percentile(value[valid], [0.5, 99.5]) if valid.any() else (0, 1)
    shown = second.imshow(np.where(valid, value, np.nan), cmap="turbo", vmin=limits[0], vmax=limits[1])
    second.set_title(f"disparity: {valid.mean():.1%} of the pixels measured", fontsize=10)
    figure.colorbar(shown, ax=second, label="px", shrink=0.8)
    for ax in (first, second):
        ax.set(xticks=[], yticks=[])
    save_figure(figure, path)


def save_voxels(
    path: str | Path,
    occupied: Bool[np.ndarray, "H W Z"],
    pitch: float,
    level_height: float,
    lowest: int,
    title: str = "",
) -> None:
    """A PNG of `voxel_figure`."""
    save_figure(voxel_figure(occupied, pitch, level_height, lowest, title), path)


@own_style()
def voxel_figure(
    occupied: Bool[np.ndarray, "H W Z"],
    pitch: float,
    level_height: float,
    lowest: int,
    title: str = "",
    size: tuple[float, float] = (9.0, 6.5),
) -> Figure:
    """The 3D grid, voxels as blocks coloured by their height, x away from the viewer; `size` in inches."""
    while exposed_count(occupied) > MOST_FACES:
        occupied, pitch, level_height, lowest = halved(occupied), 2 * pitch, 2 * level_height, lowest // 2
    faces, heights, shades = block_faces(occupied, pitch, level_height, lowest)
    figure = Figure(figsize=size, layout="constrained")
    ax = figure.subplots()
    if len(faces):
        scale = Normalize(0, max(float(heights.max()), level_height))
        colours = colormaps["viridis"](scale(heights))
        colours[:, :3] *= shades[:, None]
        flat = faces @ screen().T
        order = np.argsort(-(faces.mean(1) @ LOOK), kind="stable")
        ax.add_collection(PolyCollection(flat[order], facecolors=colours[order], edgecolors="face", linewidths=0.2))
        ax.update_datalim(flat.reshape(-1, 2))
        ax.autoscale_view()
        mappable = figure.colorbar(
            matplotlib_scale(scale), ax=ax, label="height [m]", shrink=0.6, location="right", pad=0.02
        )
        mappable.outline.set_visible(False)
    ax.set(aspect="equal", xticks=[], yticks=[])
    ax.set_title(title, fontsize=10)
    for spine in ax.spines.values():
        spine.set_visible(False)
    return figure


def matplotlib_scale(scale: Normalize):
    """The object that a colour bar needs."""
    from matplotlib.cm import ScalarMappable

    return ScalarMappable(norm=scale, cmap="viridis")


def screen() -> Float[np.ndarray, "2 3"]:
    """The axes of the picture, right and up, in the world."""
    ahead = LOOK / np.linalg.norm(LOOK)
    right = np.cross(ahead, [0, 0, 1])
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(right, ahead)])


def exposed(occupied: Bool[np.ndarray, "H W Z"]) -> list[Bool[np.ndarray, "H W Z"]]:
    """Voxels whose upper, back (-x) and right (-y) face has no voxel in front of it."""
    empty_after = np.pad(~occupied, ((1, 0), (1, 0), (0, 1)), constant_values=True)
    return [
        occupied & empty_after[1:, 1:, 1:],
        occupied & empty_after[1:, :-1, :-1],
        occupied & empty_after[:-1, 1:, :-1],
    ]


def exposed_count(occupied: Bool[np.ndarray, "H W Z"]) -> int:
    """The number of faces to draw."""
    return sum(int(mask.sum()) for mask in exposed(occupied))


def block_faces(
    occupied: Bool[np.ndarray, "H W Z"], pitch: float, level_height: float, lowest: int
) -> tuple[Float[np.ndarray, "F 4 3"], Float[np.ndarray, "F"], Float[np.ndarray, "F"]]:
    """Corners [m], height [m] and shade of each visible face."""
    corners = (
        [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
        [(0, 0, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1)],
        [(0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)],
    )
    unit = np.array([pitch, pitch, level_height])
    faces, heights, shades = [], [], []
    for mask, corner, shade in zip(exposed(occupied), corners, SHADES, strict=True):
        i, j, k = np.nonzero(mask)
        base = np.stack([j, i, k + lowest - 0.5], axis=1)
        faces.append((base[:, None] + np.array(corner)) * unit)
        heights.append(np.maximum((k + lowest) * level_height, 0))
        shades.append(np.full(len(i), shade))
    return np.concatenate(faces), np.concatenate(heights), np.concatenate(shades)


def halved(occupied: Bool[np.ndarray, "H W Z"]) -> Bool[np.ndarray, "I J K"]:
    """Eight voxels merged into one, occupied if any of them is."""
    padded = np.pad(occupied, [(0, n % 2) for n in occupied.shape])
    h, w, z = (n // 2 for n in padded.shape)
    return padded.reshape(h, 2, w, 2, z, 2).any((1, 3, 5))


@own_style()
def save_classes(
    path: str | Path, grid: ClassGrid, title: str = "", camera_xy: tuple[float, float] | None = None
) -> None:
    """A PNG of the class grid in the paper's colours; a ring where the camera stands, if it is on the map."""
    rows, columns = grid.shape
    figure = Figure(figsize=(7.0, float(np.clip(7.0 * rows / columns, 2.5, 10)) + 0.7), layout="constrained")
    ax = figure.subplots()
    x0, x1, y0, y1 = grid.extent
    on_map = camera_xy is not None and x0 <= camera_xy[0] < x1 and y0 <= camera_xy[1] < y1
    draw_map(ax, grid, MapOverlay(start_xy=camera_xy if on_map else None), axis=fitting_axis(grid))
    ax.set_title(title, fontsize=10)
    handles = [patches.Patch(fc=COLOURS[cell], ec="#888888", lw=0.6, label=cell.name.lower()) for cell in Cell]
    figure.legend(handles=handles, loc="outside lower center", ncols=5, fontsize=8, frameon=False, labelcolor=INK)
    save_figure(figure, path)


@own_style()
def save_elevation(
    path: str | Path,
    heights: Float[np.ndarray, "P Q"],
    origin_xy: Float[np.ndarray, "2"],
    pitch: float,
    title: str = "",
) -> None:
    """A PNG of an elevation map: its heights [m] in colours, lit from the upper left; holes are white."""
    rows, columns = heights.shape
    figure = Figure(figsize=(8.0, float(np.clip(7.0 * rows / columns, 2.5, 10)) + 0.5), layout="constrained")
    ax = figure.subplots()
    scale = Normalize(float(np.nanmin(heights)), float(np.nanmax(heights)))
    image = colormaps["viridis"](scale(heights))[..., :3] * (0.35 + 0.65 * hillshade(heights, pitch))[..., None]
    image = np.where(np.isfinite(heights)[..., None], image, 1.0)
    (x, y), half = origin_xy, pitch / 2
    extent = (x - half, x + (columns - 0.5) * pitch, y - half, y + (rows - 0.5) * pitch)
    ax.imshow(np.clip(image, 0, 1), origin="lower", extent=extent, interpolation="nearest")
    ax.set(xlabel="x [m]", ylabel="y [m]")
    ax.tick_params(labelsize=8, color=INK)
    ax.set_title(title, fontsize=10)
    figure.colorbar(matplotlib_scale(scale), ax=ax, label="height [m]", shrink=0.8)
    save_figure(figure, path)


def fitting_axis(grid: ClassGrid) -> Axis:
    """Centimetres for an arena, metres for more."""
    return CENTIMETRES if max(grid.shape) * grid.pitch <= LARGEST_IN_CENTIMETRES else METRES
