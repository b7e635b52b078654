"""A mission as an animated GIF: the growing map, the robot, its view and its plan."""

from __future__ import annotations

import math
from pathlib import Path

import matplotlib.patches as patches
import numpy as np
from jaxtyping import Float, UInt8
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.transforms import Affine2D, Transform
from PIL import Image

from jaxbiped.files import write_whole
from jaxbiped.mission.log import MissionLog, Picture
from jaxbiped.report.pictures import (
    BUMP_SHADES,
    CENTIMETRES,
    COLOURS,
    GOAL_RADIUS,
    INK,
    MOST_CELLS_LINED,
    OUTLINES,
    PLAN,
    TRACK,
    caption,
    class_image,
    draw_goal,
    draw_lines,
    draw_terrain,
    frame,
    mark_patch,
    mission_legend,
    moment,
)
from jaxbiped.report.style import own_style

FOOTPRINT = (0.14, 0.16)  # [m] depth and width of the e-nuvo WALK (paper, 3.1)
FIELD_OF_VIEW = math.radians(97)  # across, of the stereo camera
VIEW_RANGE = 0.60  # [m] drawn; the camera sees farther
WIDTH = 6.4  # [inch] of the figure
FRAMES_PER_SECOND, LAST_FRAME = 5, 2.0  # [1/s], [s]
COMMON_COLOURS, PICTURE_COLOURS = 120, 240  # in the palette, besides the map's; with pictures beside it
PICTURE_WIDTH = 3.2  # [inch] of the pictures


class Scene:
    """One figure whose artists are moved from moment to moment; laid out once."""

    def __init__(self, log: MissionLog, title: str, dpi: int):
        self.log, self.k, self.title = log, CENTIMETRES.per_metre, title
        height = WIDTH * float(log.size_xy[1] / log.size_xy[0]) + 1.1
        beside = PICTURE_WIDTH if log.pictures else 0.0
        self.figure = Figure(figsize=(WIDTH + beside, height), dpi=dpi, layout="constrained")
        self.canvas = FigureCanvasAgg(self.figure)
        if log.pictures:
            layout = [["left", "map"], ["disparity", "map"]]
            axes = self.figure.subplot_mosaic(layout, width_ratios=[beside, WIDTH])
            self.ax = axes["map"]
            self.draw_pictures(axes["left"], axes["disparity"])
        else:
            self.ax = self.figure.subplots()
        mission_legend(self.figure, log)
        self.draw_still()
        self.image = self.ax.imshow(class_image(log.classes[0], log.levels[0]), origin="lower", extent=self.extent)
        self.draw_moving()
        frame(self.ax, self.extent, CENTIMETRES)
        self.heading = self.ax.set_title(" ", fontsize=10)
        self.canvas.draw()
        self.figure.set_layout_engine("none")  # computing the layout takes longer than drawing
        self.inside = [
            artist
            for ax in self.figure.axes
            for artist in sorted(ax.get_children(), key=lambda artist: artist.zorder)
            if artist not in (ax.patch, ax.xaxis, ax.yaxis)
        ]
        for artist in self.inside:
            artist.set_animated(True)  # excluded from what is drawn once: legend and ticks, which take most of the time
        self.canvas.draw()
        self.around = self.canvas.copy_from_bbox(self.figure.bbox)

    @property
    def extent(self) -> tuple[float, ...]:
        """The map's outer border in axis units."""
        return tuple(value * self.k for value in moment(self.log, 0).extent)

    def draw_still(self) -> None:
        """Draw what stays: lines between cells, true boxes, landmarks, start and goal."""
        log, k, ax = self.log, self.k, self.ax
        if log.classes[0].size <= MOST_CELLS_LINED:
            draw_lines(ax, moment(log, 0), k)
        if log.terrain is not None:
            draw_terrain(ax, log.terrain, k)
        for outline in log.outlines:
            ax.add_patch(
                patches.Polygon(outline.corners_xy * k, fill=False, ec=OUTLINES[outline.kind], lw=1.2, zorder=3)
            )
        for mark in log.landmarks:
            ax.add_patch(mark_patch(mark, k))
        ax.plot(*log.true_xyyaw[0, :2] * k, "o", ms=7, mfc="white", mec=INK, mew=1.4, zorder=4)
        draw_goal(ax, tuple(log.goal_xy), GOAL_RADIUS, k)

    def draw_pictures(self, left: Axes, disparity: Axes) -> None:
        """Draw the robot's view, and the disparity measured from it."""
        pictures = self.log.pictures
        self.nearest = max(float(np.quantile(each.disparity, 0.995)) for each in pictures) or 1.0
        self.pictures = left.imshow(pictures[0].left), disparity.imshow(disparity_image(pictures[0], self.nearest))
        for ax, name in ((left, "left image"), (disparity, "disparity: red is near, white not measured")):
            ax.set_title(name, fontsize=9)
            ax.set(xticks=[], yticks=[])
            for spine in ax.spines.values():
                spine.set(color="#888888", linewidth=0.8)

    def draw_moving(self) -> None:
        """Draw what moves, at the origin of the robot's frame: view, track, plan, the robot and its belief."""
        ax, k = self.ax, self.k
        half = math.degrees(FIELD_OF_VIEW) / 2
        wedge = patches.Wedge((0, 0), VIEW_RANGE * k, -half, half, fc="#ffe14d2c", ec="#c79a00b0", lw=1.0, zorder=3.5)
        self.view = ax.add_patch(wedge)
        (self.track,) = ax.plot([], [], color=TRACK, lw=1.6, marker="o", ms=2.5, zorder=5)
        (self.plan,) = ax.plot([], [], color=PLAN, lw=2.2, marker=".", ms=5, zorder=6)
        depth, across = (side * k for side in FOOTPRINT)
        corner = (-depth / 2, -across / 2)
        robot = patches.Rectangle(corner, depth, across, fc="#fffffff0", ec=INK, lw=1.6, zorder=8)
        belief = patches.Rectangle(corner, depth, across, fill=False, ec="#d06000", ls=(0, (2, 1.5)), lw=1.3, zorder=9)
        nose = [(-depth * 0.25, -across * 0.22), (-depth * 0.25, across * 0.22), (depth * 0.42, 0)]
        self.robot, self.belief = ax.add_patch(robot), ax.add_patch(belief)
        self.nose = ax.add_patch(patches.Polygon(nose, fc=INK, zorder=8))

    def show(self, t: int) -> None:
        """Put every artist where it belongs at moment `t`."""
        log, k = self.log, self.k
        self.image.set_data(class_image(log.classes[t], log.levels[t]))
        self.track.set_data(*(log.true_xyyaw[: t + 1, :2] * k).T)
        self.plan.set_data(*(np.asarray(log.plan[t]).reshape(-1, 2) * k).T)
        if log.pictures:
            for artist, pixels in zip(
                self.pictures, (log.pictures[t].left, disparity_image(log.pictures[t], self.nearest)), strict=True
            ):
                artist.set_data(pixels)
        true = self.at(log.true_xyyaw[t])
        for artist in (self.view, self.robot, self.nose):
            artist.set_transform(true)
        self.belief.set_transform(self.at(log.estimated_xyyaw[t]))
        name = f"{self.title}   " if self.title else ""
        self.heading.set_text(f"{name}{log.time[t]:5.0f} s   step {t} of {len(log.time) - 1}   {caption(log, t)}")

    def at(self, xyyaw: Float[np.ndarray, "3"]) -> Transform:
        """The transform from the robot's frame, in axis units, to the page."""
        x, y, yaw = xyyaw
        return Affine2D().rotate(float(yaw)).translate(float(x) * self.k, float(y) * self.k) + self.ax.transData

    def pixels(self, t: int) -> Image.Image:
        """The figure at moment `t`."""
        self.show(t)
        self.canvas.restore_region(self.around)
        for artist in self.inside:
            artist.draw(self.canvas.get_renderer())
        return Image.fromarray(np.asarray(self.canvas.buffer_rgba())[..., :3])


@own_style()
def save_gif(path: str | Path, log: MissionLog, *, title: str = "", dpi: int = 90) -> None:
    """Write a mission as a GIF, one frame per moment at 5 frames a second, with the last one held for 2 s.

    If the log has pictures, they are shown beside the map, as in the paper's Figs. 3 and 6.
    The robot's true pose is a filled footprint with its nose, its belief a dotted one; the wedge is the
    camera's field of view.

    Raises:
      InputError: the file cannot be written; nothing is left behind.
    """
    scene = Scene(log, title, dpi)
    frames = [scene.pixels(t) for t in range(len(log.time))]
    palette = shared_palette(frames, PICTURE_COLOURS if log.pictures else COMMON_COLOURS)
    frames = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    durations = [1000 // FRAMES_PER_SECOND] * (len(frames) - 1) + [round(LAST_FRAME * 1000)]
    options = {"save_all": True, "append_images": frames[1:], "duration": durations, "loop": 0}
    write_whole(path, lambda file: frames[0].save(file, format="GIF", **options))


def disparity_image(picture: Picture, nearest: float) -> UInt8[np.ndarray, "h w 3"]:
    """Disparities as colours, from blue (far) to red (`nearest` px); white where nothing was measured."""
    shade = colormaps["turbo"](np.clip(picture.disparity / nearest, 0, 1))[..., :3]
    return np.where(picture.disparity[..., None] > 0, np.round(255 * shade), 255).astype(np.uint8)


def shared_palette(frames: list[Image.Image], colours: int) -> Image.Image:
    """One palette for all frames: the map's own colours, and the most common others in three frames.

    One palette avoids flicker; the map's own colours are included so that a class seen in few cells keeps its colour.
    """
    strip = np.concatenate([np.asarray(frame) for frame in (frames[0], frames[len(frames) // 2], frames[-1])])
    common = Image.fromarray(strip).quantize(colours, method=Image.Quantize.MEDIANCUT).getpalette()
    own = [round(255 * channel) for colour in (*COLOURS.values(), *BUMP_SHADES) for channel in to_rgb(colour)]
    palette = Image.new("P", (1, 1))
    palette.putpalette((own + common)[: 3 * 256])
    return palette
