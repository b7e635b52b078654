"""How a map is made, as in Figs. 3 and 5 to 7 of the paper: picture, points, 3D grid, C-obstacles, 2D grid."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float32
from matplotlib import colormaps
from matplotlib.figure import Figure

from jaxbiped.mapping import GridSpec
from jaxbiped.mapping.cobstacles import dilate
from jaxbiped.mission.log import MissionLog, Picture
from jaxbiped.motion.config import RobotConfig
from jaxbiped.report.animation import disparity_image
from jaxbiped.report.examples import picture
from jaxbiped.report.measured import screen, voxel_figure
from jaxbiped.report.page_figures import WIDTH, Plot
from jaxbiped.report.style import own_style
from jaxbiped.reproduction.pictures import map_figure

MOST_POINTS = 12_000  # most points drawn
INK_AREA = 15_000.0  # [points2] of all their marks
HEIGHT = 3.6  # [inch]


def making_of(log: MissionLog, t: int, robot: RobotConfig) -> list[Plot]:
    """The steps from a picture to the map at moment `t`; those missing in the log are left out."""
    plots = []

    def add(figure: Figure, caption: str) -> None:
        plots.append(Plot(picture(figure, caption), caption))

    if log.pictures:
        caption = "The left camera's view, and disparities: red is near, white not measured."
        add(eyes_figure(log.pictures[t]), caption)
    if log.points:
        add(points_figure(log.points[t]), f"{len(log.points[t]):,} measured points, coloured by their height.")
    if log.voxels is not None:
        size = (WIDTH, HEIGHT)
        add(
            voxel_figure(log.voxels[t], log.pitch, log.level_height, 0, size=size),
            "The 3D grid of all measurements so far: 5 x 5 x 3 cm.",
        )
        grown = c_obstacles(log, t, robot)
        caption = (
            f"C-obstacles: everything higher than a step, grown by the robot's radius of {100 * robot.radius:g} cm."
        )
        add(voxel_figure(grown, log.pitch, log.level_height, 0, size=size), caption)
    add(map_figure(log, t), f"The 2D grid used for planning, after {t + 1} measurements.")
    return plots


@own_style()
def eyes_figure(shot: Picture) -> Figure:
    """The left image, and its disparities."""
    figure = Figure(figsize=(WIDTH, WIDTH * 0.39), layout="constrained")
    nearest = float(np.quantile(shot.disparity, 0.995)) or 1.0
    for ax, pixels in zip(figure.subplots(1, 2), (shot.left, disparity_image(shot, nearest)), strict=True):
        ax.imshow(pixels)
        ax.set(xticks=[], yticks=[])
    return figure


@own_style()
def points_figure(points: Float32[np.ndarray, "N 3"]) -> Figure:
    """Points in the view of the 3D grid, x away from the viewer; evenly thinned if there are many."""
    figure = Figure(figsize=(WIDTH, HEIGHT), layout="constrained")
    ax = figure.subplots()
    drawn = points[:: max(1, len(points) // MOST_POINTS)]
    flat = drawn @ screen().T.astype(np.float32)
    height = np.clip(drawn[:, 2], 0, None)
    size = float(np.clip(INK_AREA / max(len(drawn), 1), 1.2, 8.0))
    ax.scatter(*flat.T, c=height, s=size, lw=0, cmap=colormaps["viridis"], rasterized=True)
    ax.set(aspect="equal", xticks=[], yticks=[])
    ax.axis("off")
    return figure


def c_obstacles(log: MissionLog, t: int, robot: RobotConfig) -> Bool[np.ndarray, "H W Z"]:
    """Occupied voxels, and those filled by an obstacle when it is grown by the robot's radius (paper, Figs. 4, 5c).

    Obstacles are what lies more than one step above the base floor.
    """
    voxels = log.voxels[t]
    height, width, levels = voxels.shape
    bits = np.uint32(1) << np.arange(levels, dtype=np.uint32)
    first = int(np.floor(robot.step / log.level_height)) + 1  # first level above the height of a step
    columns = np.sum(np.where(voxels[..., first:], bits[first:], 0), axis=-1, dtype=np.uint32)
    spec = GridSpec(size_x=width * log.pitch, size_y=height * log.pitch, pitch=log.pitch)
    grown = np.asarray(dilate(jnp.asarray(columns), jnp.float32(robot.radius), spec))
    return voxels | ((grown[..., None] & bits) != 0)
