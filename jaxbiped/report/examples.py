"""Maps of the missions where two sides differ most, side by side."""

from __future__ import annotations

import base64
import io
from html import escape

import polars as pl
from matplotlib.figure import Figure

from jaxbiped.errors import InputError
from jaxbiped.mission.recorded_driver import Mission
from jaxbiped.report.page import Section
from jaxbiped.report.page_figures import WIDTH, Plot
from jaxbiped.report.pictures import MapOverlay, draw_map, moment
from jaxbiped.report.style import own_style
from jaxbiped.study.replay import Origin, examples, play_again

KEY = (
    "Maps as the robots held them at the end: grey floor, blue bump with its level, purple gate, red obstacle and "
    "all that is too close, white unmeasured. Outlines are the true boxes; discs and squares are landmarks; the black "
    "line is the robot's track, from the ring to the cross."
)
DPI = 110


def example_section(
    frame: pl.DataFrame, names: tuple[str, str], origins: tuple[Origin, Origin], count: int
) -> Section | None:
    """Replay and draw the missions where two sides differ most; None if they differ nowhere.

    Args:
      frame: rows with two names in `strategy`.
      names: the two names, in the order of `origins`.
      origins: where their missions come from.
    """
    found = examples(frame, *names, count)
    if not found:
        return None
    title, arenas = "Where they differ most", [example.arena for example in found]
    try:
        sides = [play_again(*origin, arenas) for origin in origins]
    except InputError as error:
        return Section(title, (f"Not drawn: {error}.",))
    plots, changed = [], []
    for k, example in enumerate(found):
        start = f"Arena {example.arena} ({example.family}, difficulty {example.difficulty:.2f}): {example.why}. "
        for name, missions in zip(names, sides, strict=True):
            caption = f"{start}{name}: {ending(missions[k])}."
            plots.append(Plot(picture(last_map(missions[k]), caption), caption))
            row = frame.row(by_predicate=(pl.col("arena") == example.arena) & (pl.col("strategy") == name), named=True)
            if row["code"] != missions[k].code.label:
                changed.append(f"{name} on arena {example.arena} ended as {row['code']} when it was stored")
            start = ""
    text = (KEY, f"Replayed here, these differ: {'; '.join(changed)}.") if changed else (KEY,)
    return Section(title, text, tuple(plots), kind="pairs")


def ending(mission: Mission) -> str:
    """How a mission ended."""
    return f"{mission.code.label.replace('_', ' ')}, {100 * mission.distance:.0f} cm in {mission.time / 60:.1f} min"


@own_style()
def last_map(mission: Mission) -> Figure:
    """The map that the robot held at the end, its track, and the true arena."""
    log = mission.log
    figure = Figure(figsize=(WIDTH, WIDTH * float(log.size_xy[1] / log.size_xy[0])), layout="constrained")
    draw_map(
        figure.subplots(),
        moment(log, len(log.time) - 1),
        MapOverlay(
            track_xy=log.true_xyyaw[:, :2],
            start_xy=tuple(log.true_xyyaw[0, :2]),
            goal_xy=tuple(log.goal_xy),
            outlines=log.outlines,
            landmarks=log.landmarks,
        ),
    )
    return figure


@own_style()
def picture(figure: Figure, description: str) -> str:
    """The figure as an `<img>` element that holds its PNG."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI, facecolor="white", metadata={"Software": None})
    data = base64.b64encode(buffer.getvalue()).decode()
    return f'<img alt="{escape(description)}" src="data:image/png;base64,{data}">'
