"""Pictures of an experiment, as in Figs. 12 to 17 of the paper: the growing map, the plan, and the track."""

from __future__ import annotations

from matplotlib.figure import Figure

from jaxbiped.mission.log import MissionLog
from jaxbiped.report.examples import picture
from jaxbiped.report.page_figures import WIDTH, Plot
from jaxbiped.report.pictures import MapOverlay, draw_map, moment
from jaxbiped.report.style import own_style

KEY = (
    "Maps as the robot held them: grey floor, blue bump with its level, purple gate, red obstacle and everything too "
    "close to one, white unmeasured. Green: the plan. Black: the track, from the ring to the cross. Outlines are the "
    "true boxes; discs and squares are landmarks."
)


@own_style()
def map_figure(log: MissionLog, t: int, *, plan: bool = True) -> Figure:
    """The map at a moment, with the plan ahead and the track so far."""
    figure = Figure(figsize=(WIDTH, WIDTH * float(log.size_xy[1] / log.size_xy[0])), layout="constrained")
    draw_map(
        figure.subplots(),
        moment(log, t),
        MapOverlay(
            plan_xy=log.plan[t] if plan else None,
            track_xy=log.true_xyyaw[: t + 1, :2],
            start_xy=tuple(log.true_xyyaw[0, :2]),
            goal_xy=tuple(log.goal_xy),
            outlines=log.outlines,
            landmarks=log.landmarks,
        ),
    )
    return figure


def growing(log: MissionLog) -> list[Plot]:
    """The map at the first, third and last measurement (paper, Figs. 12 and 13), the last with the whole track."""
    last = len(log.time) - 1
    measured = last  # measurements in the log; the outcome of the last one is its last moment
    plots = []
    for number in dict.fromkeys((1, min(3, measured), measured)):
        t = number - 1 if number < measured else last
        name = f"Measurement {number} of {measured}" + (
            f", and the whole track: {log.outcome.replace('_', ' ')}." if t == last else "."
        )
        plots.append(Plot(picture(map_figure(log, t), name), name))
    return plots
