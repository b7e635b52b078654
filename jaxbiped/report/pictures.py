"""Pictures of maps in the paper's colours: grey floor, blue bump, red obstacle, purple gate, white unmeasured."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import matplotlib.patches as patches
import matplotlib.patheffects as effects
import numpy as np
from jaxtyping import Float, Int8, UInt8
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.transforms import Affine2D

from jaxbiped.arenas.arena import DISC_RADIUS, SQUARE_SIDE
from jaxbiped.core.class_grid import ClassGrid
from jaxbiped.files import write_whole
from jaxbiped.mapping.grid import Cell
from jaxbiped.mission.log import Ground, Mark, MissionLog, Outline
from jaxbiped.report.axis import CENTIMETRES as CENTIMETRES
from jaxbiped.report.axis import METRES as METRES
from jaxbiped.report.axis import Axis as Axis
from jaxbiped.report.map_legend import draw_legend
from jaxbiped.report.palette import BUMP_SHADES as BUMP_SHADES
from jaxbiped.report.palette import COLOURS as COLOURS
from jaxbiped.report.palette import INK as INK
from jaxbiped.report.palette import MARKS
from jaxbiped.report.palette import OUTLINES as OUTLINES
from jaxbiped.report.palette import PLAN as PLAN
from jaxbiped.report.palette import TRACK as TRACK
from jaxbiped.report.style import own_style

GOAL_RADIUS = 0.10  # [m] "reached" (paper, 3.1)
MOST_CELLS_LINED = 6000  # beyond that, cells are too small for grid lines and numbers
MOST_SHADE = 0.55  # opacity of terrain shadows
MOST_ARROWS = 150  # beyond that, a plan is a line


@dataclass(frozen=True)
class MapOverlay:
    """What is drawn over a map: a mission, and the truth behind the map."""

    plan_xy: Float[np.ndarray, "n 2"] | None = None  # [m] planned path: arrows, or a line if there are many points
    track_xy: Float[np.ndarray, "m 2"] | None = None  # [m] path walked
    start_xy: tuple[float, float] | None = None  # [m] a ring
    goal_xy: tuple[float, float] | None = None  # [m] a cross
    goal_radius: float | None = GOAL_RADIUS  # [m] of a dashed circle around it; None: no circle
    outlines: tuple[Outline, ...] = ()
    landmarks: tuple[Mark, ...] = ()
    terrain: Ground | None = None


def class_image(classes: Int8[np.ndarray, "H W"], levels: Int8[np.ndarray, "H W"]) -> UInt8[np.ndarray, "H W 3"]:
    """The map as RGB; bumps darken with their distance from level 0."""
    palette = np.array([to_rgb(COLOURS[cell]) for cell in Cell])
    image = palette[classes]
    shades = np.array([to_rgb(shade) for shade in BUMP_SHADES])
    bump = classes == Cell.BUMP
    image[bump] = shades[np.clip(np.abs(levels[bump].astype(int)) - 1, 0, len(shades) - 1)]
    return np.round(image * 255).astype(np.uint8)


def draw_map(
    ax: Axes,
    grid: ClassGrid,
    overlay: MapOverlay | None = None,
    *,
    axis: Axis = CENTIMETRES,
) -> None:
    """Draw a map and a mission on it into `ax`.

    Args:
      ax: the axes to draw into.
      grid: the map.
      axis: the unit of the axes.
    """
    over = overlay or MapOverlay()
    k = axis.per_metre
    x0, x1, y0, y1 = (value * k for value in grid.extent)
    turn = turned(grid, k)
    image = class_image(grid.classes, grid.levels)
    style = {"origin": "lower", "interpolation": "nearest", "transform": turn + ax.transData}
    ax.imshow(image, extent=(x0, x1, y0, y1), **style)
    small = grid.classes.size <= MOST_CELLS_LINED
    if small:
        draw_lines(ax, grid, k)
        draw_levels(ax, grid, k)
    if over.terrain is not None:
        draw_terrain(ax, over.terrain, k)
    for outline in over.outlines:
        ax.add_patch(patches.Polygon(outline.corners_xy * k, fill=False, ec=OUTLINES[outline.kind], lw=1.2, zorder=3))
    for mark in over.landmarks:
        ax.add_patch(mark_patch(mark, k))
    if over.track_xy is not None and len(over.track_xy) > 1:
        halo = [effects.Stroke(linewidth=3.2, foreground="white"), effects.Normal()]
        ax.plot(*(over.track_xy * k).T, color=TRACK, lw=1.6, marker="o", ms=2.2, zorder=5, path_effects=halo)
    if over.plan_xy is not None and len(over.plan_xy) > 1:
        draw_plan(ax, over.plan_xy * k)
    if over.start_xy is not None:
        ax.plot(over.start_xy[0] * k, over.start_xy[1] * k, "o", ms=8, mfc="white", mec=INK, mew=1.6, zorder=7)
    if over.goal_xy is not None:
        draw_goal(ax, over.goal_xy, over.goal_radius, k)
    corners = turn.transform([(x0, y0), (x1, y0), (x0, y1), (x1, y1)])
    (x0, y0), (x1, y1) = corners.min(0), corners.max(0)
    frame(ax, (x0, x1, y0, y1), axis)


def hillshade(heights: Float[np.ndarray, "P Q"], pitch: float) -> Float[np.ndarray, "P Q"]:
    """Brightness, 0 to 1, of a surface with such heights [m], lit from the upper left; level ground is at 0.71.

    Where the slope is unknown, at holes, it is assumed to be level.
    """
    slope_y, slope_x = (np.nan_to_num(slope) for slope in np.gradient(heights, pitch))
    light = np.array([-0.5, 0.5, math.sqrt(0.5)])
    return np.clip((light[2] - light[0] * slope_x - light[1] * slope_y) / np.sqrt(1 + slope_x**2 + slope_y**2), 0, 1)


def turned(grid: ClassGrid, k: float) -> Affine2D:
    """From the axes of a grid, with `k` units per metre, to those of its frame, in which it may be rotated."""
    x0, _, y0, _ = (value * k for value in grid.extent)
    return Affine2D().rotate_around(x0, y0, grid.yaw)


def draw_lines(ax: Axes, grid: ClassGrid, k: float) -> None:
    """Draw thin lines between cells."""
    rows, columns = grid.shape
    x0, x1, y0, y1 = (value * k for value in grid.extent)
    style = {"color": "#606060", "lw": 0.4, "alpha": 0.22, "zorder": 1, "transform": turned(grid, k) + ax.transData}
    ax.vlines(np.linspace(x0, x1, columns + 1)[1:-1], y0, y1, **style)
    ax.hlines(np.linspace(y0, y1, rows + 1)[1:-1], x0, x1, **style)


def draw_terrain(ax: Axes, terrain: Ground, k: float) -> None:
    """Draw terrain over the map as shaded relief; holes are hatched."""
    rows, columns = terrain.heights.shape
    x, y = terrain.origin_xy
    extent = tuple(v * k for v in (x, x + (columns - 1) * terrain.pitch, y, y + (rows - 1) * terrain.pitch))
    light = hillshade(terrain.heights, terrain.pitch) - math.sqrt(0.5)
    shade = np.zeros((rows, columns, 4))
    shade[..., :3] = np.where(light > 0, 1.0, 0.0)[..., None]
    shade[..., 3] = np.clip(1.2 * np.abs(light), 0, MOST_SHADE)
    ax.imshow(shade, origin="lower", extent=extent, interpolation="bilinear", zorder=1.5)
    if np.isnan(terrain.heights).any():
        places = [np.linspace(low, high, count) for low, high, count in zip(
            extent[::2], extent[1::2], (columns, rows), strict=True)]  # fmt: skip
        holes = np.isnan(terrain.heights).astype(float)
        ax.contourf(*places, holes, levels=[0.5, 1.5], colors="none", hatches=["xxxx"], zorder=1.6)


def draw_levels(ax: Axes, grid: ClassGrid, k: float) -> None:
    """Write the level into each bump cell."""
    bumps = np.argwhere(grid.classes == Cell.BUMP)
    style = {"color": "white", "size": 6, "ha": "center", "va": "center", "clip_on": True, "zorder": 2}
    for (i, j), (x, y) in zip(bumps, grid.centres_xy(bumps) * k, strict=True):
        ax.text(x, y, str(grid.levels[i, j]), **style)


def draw_plan(ax: Axes, path: Float[np.ndarray, "n 2"]) -> None:
    """Draw a path in axis units: one arrow per step, or a line if there are too many to distinguish."""
    if len(path) <= MOST_ARROWS:
        (x, y), (u, v) = path[:-1].T, np.diff(path, axis=0).T
        options = {"headwidth": 4.5, "headlength": 5, "headaxislength": 4.5, "width": 0.004}
        ax.quiver(x, y, u, v, angles="xy", scale_units="xy", scale=1, color=PLAN, zorder=6, **options)
    else:
        ax.plot(*path.T, color=PLAN, lw=1.8, zorder=6)


def draw_goal(ax: Axes, goal_xy: tuple[float, float], radius: float | None, k: float) -> None:
    """Draw a cross and a dashed circle around it, within which the goal counts as reached."""
    x, y = goal_xy[0] * k, goal_xy[1] * k
    ax.plot(x, y, "x", ms=9, mec=INK, mew=2.4, zorder=7)
    if radius is not None:
        ax.add_patch(patches.Circle((x, y), radius * k, fill=False, ec=INK, ls=(0, (4, 3)), lw=1.2, zorder=7))


def mark_patch(mark: Mark, k: float) -> patches.Patch:
    """A landmark: a red disc or a blue square, as in the paper."""
    x, y = mark.xy[0] * k, mark.xy[1] * k
    if mark.kind == "circle":
        return patches.Circle((x, y), DISC_RADIUS * k, **face(mark), lw=1.3, zorder=2.5)
    side, corner = SQUARE_SIDE * k, SQUARE_SIDE * k / 2
    angle = math.degrees(mark.yaw)
    corner_xy, about = (x - corner, y - corner), {"angle": angle, "rotation_point": "center"}
    return patches.Rectangle(corner_xy, side, side, **about, **face(mark), zorder=2.5)


def face(mark: Mark) -> dict[str, str]:
    """Fill and edge colours of a landmark."""
    return {"fc": MARKS[mark.kind]["mfc"], "ec": MARKS[mark.kind]["mec"]}


def frame(ax: Axes, extent: tuple[float, float, float, float], axis: Axis) -> None:
    """Set limits, labels and a thin border."""
    x0, x1, y0, y1 = extent
    ax.set(xlim=(x0, x1), ylim=(y1, y0) if axis.y_down else (y0, y1), aspect="equal")
    ax.set(xlabel=f"x [{axis.unit}]", ylabel=f"y [{axis.unit}]")
    ax.tick_params(labelsize=8, color=INK)
    for spine in ax.spines.values():
        spine.set(color="#888888", linewidth=0.8)


@own_style()
def save_figure(figure: Figure, path: str | Path, dpi: int = 150) -> None:
    """Write `figure` as PNG, whole or not at all; raise `InputError` if that fails."""
    write_whole(path, lambda file: figure.savefig(file, format="png", dpi=dpi, facecolor="white"))


@own_style()
def save_map(
    path: str | Path, grid: ClassGrid, overlay: MapOverlay | None = None, *, title: str = "", axis: Axis = CENTIMETRES
) -> None:
    """Write a PNG of one map, as `draw_map` draws it."""
    over = overlay or MapOverlay()
    rows, columns = grid.shape
    width = 7.0
    figure = Figure(figsize=(width, float(np.clip(width * rows / columns, 2.5, 10)) + 0.7), layout="constrained")
    ax = figure.subplots()
    draw_map(ax, grid, over, axis=axis)
    ax.set_title(title, fontsize=10)
    circle = over.goal_radius if over.goal_xy is not None else None
    shown = {"track": over.track_xy is not None, "landmarks": over.landmarks}
    draw_legend(figure, truth=bool(over.outlines), circle=circle, **shown)
    save_figure(figure, path)


def moment(log: MissionLog, t: int) -> ClassGrid:
    """The map that the robot held at moment `t`."""
    return ClassGrid(log.classes[t], log.levels[t], np.asarray(log.origin_xy, float), log.pitch)


@own_style()
def save_mission(path: str | Path, log: MissionLog, *, title: str = "", panels: int = 4) -> None:
    """Write a PNG of a mission: the map at up to `panels` evenly spaced moments, the plan and the track so far."""
    moments = np.unique(np.linspace(0, len(log.time) - 1, panels).round().astype(int)).tolist()
    columns = min(2, len(moments))
    rows = math.ceil(len(moments) / columns)
    height = 4.6 * float(log.size_xy[1] / log.size_xy[0]) + 0.75
    figure = Figure(figsize=(5.2 * columns, height * rows + 0.9), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for ax, t in zip(axes, moments, strict=False):
        draw_map(
            ax,
            moment(log, t),
            MapOverlay(
                plan_xy=log.plan[t],
                track_xy=log.true_xyyaw[: t + 1, :2],
                start_xy=tuple(log.true_xyyaw[0, :2]),
                goal_xy=tuple(log.goal_xy),
                outlines=log.outlines,
                landmarks=log.landmarks,
                terrain=log.terrain,
            ),
        )
        ax.set_title(f"{log.time[t]:.0f} s: {caption(log, t)}", fontsize=9)
    for ax in axes[len(moments) :]:
        ax.remove()
    figure.suptitle(title, fontsize=11)
    mission_legend(figure, log)
    save_figure(figure, path)


def mission_legend(figure: Figure, log: MissionLog) -> None:
    """Draw the legend of a mission's maps."""
    what = {"truth": bool(log.outlines), "landmarks": log.landmarks, "circle": GOAL_RADIUS}
    draw_legend(figure, track=True, grown=True, **what)


def caption(log: MissionLog, t: int) -> str:
    """What was done last and, at the end, how the mission ended."""
    last = t == len(log.time) - 1
    return f"{log.action[t]} ({log.outcome.replace('_', ' ')})" if last and log.outcome else log.action[t]
