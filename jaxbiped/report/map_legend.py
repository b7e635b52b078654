"""The legend of a map: what its colours, lines and symbols mean."""

from __future__ import annotations

import matplotlib.patches as patches
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from jaxbiped.mapping.grid import Cell
from jaxbiped.mission.log import Mark
from jaxbiped.report.palette import COLOURS, INK, MARKS, PLAN, TRACK

GROWN = "obstacle + robot's radius"
WIDE = 7.5  # [inch] of a figure with room for four columns


def draw_legend(
    figure: Figure,
    *,
    plan: bool = True,
    track: bool = False,
    truth: bool = False,
    landmarks: tuple[Mark, ...] = (),
    circle: float | None = None,
    grown: bool = False,
) -> None:
    """Rows under the figure that say what colours and lines mean.

    Args:
      plan, track, truth, landmarks: whether these are drawn.
      circle: [m] radius of the circle around the goal; None: no circle.
      grown: whether obstacles are grown for the robot's centre, as on a map that a mission plans on.
    """
    names = {cell: cell.name.lower() for cell in Cell} | ({Cell.OBSTACLE: GROWN} if grown else {})
    handles = [patches.Patch(fc=COLOURS[cell], ec="#888888", lw=0.6, label=names[cell]) for cell in Cell]
    if truth:
        handles.append(patches.Patch(fill=False, ec=INK, lw=1.2, label="true outline"))
    for kind, colours in MARKS.items():
        if any(mark.kind == kind for mark in landmarks):
            sign = "o" if kind == "circle" else "s"
            handles.append(Line2D([], [], ls="", marker=sign, ms=7, **colours, label=f"landmark ({kind})"))
    if plan:
        handles.append(Line2D([], [], color=PLAN, lw=2, marker=">", ms=5, label="plan"))
    if track:
        handles.append(Line2D([], [], color=TRACK, lw=1.6, marker="o", ms=3, label="walked"))
    handles.append(Line2D([], [], ls="", marker="o", ms=7, mfc="white", mec=INK, mew=1.5, label="start"))
    handles.append(Line2D([], [], ls="", marker="x", ms=7, mec=INK, mew=2, label="goal"))
    if circle is not None:
        label = f"reached within {100 * circle:g} cm"
        handles.append(Line2D([], [], color=INK, ls=(0, (4, 3)), lw=1.2, label=label))
    columns = 4 if figure.get_figwidth() >= WIDE else 3
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, fontsize=8, frameon=False)
