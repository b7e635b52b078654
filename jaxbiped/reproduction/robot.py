"""The pictures of the walking robot that the page shows for each experiment."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping
from html import escape

import numpy as np
from PIL import Image

from jaxbiped.biped.config import RobotModelConfig
from jaxbiped.errors import InputError
from jaxbiped.mission.log import MissionLog
from jaxbiped.mission.recorded_driver import NAMES
from jaxbiped.motion.primitives import Primitive
from jaxbiped.report.page_figures import Plot
from jaxbiped.reproduction.paper import EXPERIMENTS, Experiment
from jaxbiped.reproduction.scenery import frames_of, nearest_to, photographs

STAGES = (0.3, 0.5, 0.7)  # of a step over an edge
STEPS = {
    "Stepping up": NAMES[Primitive.STEP_UP_BUMP],
    "Stepping down": NAMES[Primitive.STEP_DOWN_BUMP],
}
HIGHEST = "At the highest point of its path."
QUALITY = 85  # of JPEG
SMALL, GAP = (400, 300), 8  # [px] of a picture in a strip, and between two
ABREAST = -90.0  # [deg] a camera on the robot's left


def robot_plots(item: Experiment, log: MissionLog, robot: RobotModelConfig) -> tuple[list[Plot], str]:
    """Pictures of the robot, and why there are none if it was not simulated or cannot be rendered."""
    if log.walk is None:
        return [], "The robot was not simulated, so there is no picture of it."
    wanted = moments(item, log)
    if not wanted:
        return [], ""
    try:
        shots = photographs(log, robot, list(wanted.values()), through=item.gate, side=ABREAST if item.edges else 125.0)
    except InputError as error:
        return [], f"The robot is not shown: {error}."
    return [Plot(photo(shot, caption), caption) for shot, caption in zip(shots, wanted, strict=True)], ""


def strip(logs: Mapping[int, MissionLog], robot: RobotModelConfig) -> Image.Image | None:
    """The robot stepping up, on the bump, stepping down (experiment 5), and under the gate (6), side by side.

    None if one of these is not in the logs, or nothing can be rendered.
    """
    over, through = EXPERIMENTS[4], EXPERIMENTS[5]
    if any(logs[item.number].walk is None for item in (over, through)):
        return None
    stepping, squatting = moments(over, logs[over.number]), moments(through, logs[through.number])
    wanted = [f"{name}, 2 of {len(STAGES)}." for name in STEPS]
    if not all(name in stepping for name in wanted):
        return None
    chosen = [stepping[wanted[0]], stepping[HIGHEST], stepping[wanted[1]]]
    try:
        shots = photographs(logs[over.number], robot, chosen, side=ABREAST)
        shots += photographs(logs[through.number], robot, list(squatting.values()), through=True)
    except InputError:
        return None
    width, height = SMALL
    picture = Image.new("RGB", (len(shots) * (width + GAP) - GAP, height), "white")
    for k, shot in enumerate(shots):
        picture.paste(shot.resize(SMALL), (k * (width + GAP), 0))
    return picture


def moments(item: Experiment, log: MissionLog) -> dict[str, int]:
    """Captions, and numbers of states of `log.walk`."""
    wanted: dict[str, int] = {}
    if item.edges:
        for name, action in STEPS.items():
            frames = frames_of(log, action)
            for k, stage in enumerate(STAGES if frames else (), start=1):
                wanted[f"{name}, {k} of {len(STAGES)}."] = frames[int(stage * (len(frames) - 1))]
        wanted[HIGHEST] = int(np.argmax(log.walk.qpos[:, 2]))
    elif item.gate:
        wanted["Squatting under the lintel, which is drawn transparent."] = nearest_to(log, "gate")[0]
    elif any(outline.kind == "obstacle" for outline in log.outlines):
        number, away = nearest_to(log, "obstacle")
        wanted[f"Passing the obstacle, {100 * away:.0f} cm from its middle."] = number
    return wanted


def photo(image: Image.Image, description: str) -> str:
    """The picture as an `<img>` element that holds its JPEG."""
    buffer = io.BytesIO()
    image.save(buffer, "JPEG", quality=QUALITY)
    data = base64.b64encode(buffer.getvalue()).decode()
    return f'<img alt="{escape(description)}" src="data:image/jpeg;base64,{data}">'
