"""Which pictures of the walking robot the page shows of each experiment."""

from __future__ import annotations

import base64
import io
from html import escape

import numpy as np
from PIL import Image

from jaxbiped.errors import InputError
from jaxbiped.mission.log import MissionLog
from jaxbiped.mission.stepped import NAMES
from jaxbiped.motion.biped import RobotModelConfig
from jaxbiped.motion.primitives import Primitive
from jaxbiped.report.plots import Plot
from jaxbiped.report.reproduction.scenery import frames_of, nearest_to, photographs
from jaxbiped.study.reproduction.paper import Experiment

STAGES = (0.3, 0.5, 0.7)  # of a step over an edge
STEPS = {
    "Stepping up": NAMES[Primitive.STEP_UP_BUMP],
    "Stepping down": NAMES[Primitive.STEP_DOWN_BUMP],
}
QUALITY = 85  # of JPEG
ABREAST = -90.0  # [deg] a camera on the robot's left


def robot_plots(item: Experiment, log: MissionLog, robot: RobotModelConfig) -> tuple[list[Plot], str]:
    """Pictures of the robot, and why there are none where it was not simulated or cannot be rendered."""
    if log.walk is None:
        return [], "The robot was not simulated, so that there is no picture of it."
    wanted = moments(item, log)
    if not wanted:
        return [], ""
    try:
        shots = photographs(log, robot, list(wanted.values()), through=item.gate, side=ABREAST if item.edges else 125.0)
    except InputError as error:
        return [], f"The robot is not shown: {error}."
    return [Plot(photo(shot, caption), caption) for shot, caption in zip(shots, wanted, strict=True)], ""


def moments(item: Experiment, log: MissionLog) -> dict[str, int]:
    """Captions, and numbers of states of `log.walk`."""
    wanted: dict[str, int] = {}
    if item.edges:
        for name, action in STEPS.items():
            frames = frames_of(log, action)
            for k, stage in enumerate(STAGES if frames else (), start=1):
                wanted[f"{name}, {k} of {len(STAGES)}."] = frames[int(stage * (len(frames) - 1))]
        wanted["At the highest place of its way."] = int(np.argmax(log.walk.qpos[:, 2]))
    elif item.gate:
        wanted["Squatting under the lintel, which is drawn to be seen through."] = nearest_to(log, "gate")[0]
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
