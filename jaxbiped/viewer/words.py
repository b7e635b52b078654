"""Texts of the page: the legend of its colours, and the progress of a mission."""

from __future__ import annotations

import numpy as np

from jaxbiped.mapping.grid import Cell
from jaxbiped.mission.log import MissionLog
from jaxbiped.report.pictures import BUMP_SHADES, COLOURS, INK, PLAN, TRACK, caption
from jaxbiped.viewer.triangles import height_colours

BELIEF = "#d06000"
HEIGHTS = (0.0, 0.1, 0.2, 0.3, 0.4)  # [m] of the legend


def status(log: MissionLog, t: int, time: float, arrived: float) -> str:
    """The progress of a mission at a time [s], in Markdown.

    Args:
      t: its moment.
      arrived: [s] when the action after this moment ends; then it measures.
    """
    last = len(log.time) - 1
    doing = caption(log, t) if t == last else log.action[t + 1] if time < arrived else "measuring"
    plan = f"{len(log.plan[t])} cells to go" if len(log.plan[t]) else "no plan"
    measured = f"{min(t + 1, max(last, 1))} of {max(last, 1)} measurements"
    return f"**{time:.0f} s** of {log.time[-1]:.0f} s · {measured}\n\n**{doing}**" + (f" · {plan}" if t < last else "")


def legend() -> str:
    """Colours and lines, in HTML."""
    rows = [(COLOURS[cell], cell.name.lower()) for cell in Cell if cell != Cell.UNMEASURED]
    rows = [row if row[1] != "bump" else (BUMP_SHADES[0], "bump (darker: 6 cm)") for row in rows]
    rows += [("#ffffff", "unmeasured"), (PLAN, "plan"), (TRACK, "walked"), (BELIEF, "believed pose")]
    cells = "".join(
        f'<div style="display:flex;align-items:center;gap:.5em">'
        f'<span style="width:1.1em;height:1.1em;border-radius:3px;background:{colour};border:1px solid #8886"></span>'
        f"<span>{text}</span></div>"
        for colour, text in rows
    )
    shades = ", ".join("rgb({}, {}, {})".format(*colour) for colour in height_colours(np.array(HEIGHTS)))
    scale = (
        f'<div style="margin-top:.5em">points and voxels: height'
        f'<div style="height:.8em;border-radius:3px;background:linear-gradient(to right, {shades})"></div>'
        f'<div style="display:flex;justify-content:space-between"><span>0</span><span>40 cm</span></div></div>'
    )
    return (
        f'<div style="font-size:.8em;padding:.2em .8em .6em;columns:2;color:{INK}">{cells}</div>'
        f'<div style="font-size:.8em;padding:0 .8em .6em">{scale}</div>'
    )
