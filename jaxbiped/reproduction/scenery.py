"""The robot in its scene, rendered by MuJoCo at its true poses, as in Figs. 10, 11, 14 to 17 of the paper."""

from __future__ import annotations

import mujoco
import numpy as np
from jaxtyping import Float32
from PIL import Image

from jaxbiped.arenas.arena import DISC_RADIUS, SQUARE_SIDE
from jaxbiped.biped.config import RobotModelConfig
from jaxbiped.biped.model import add_terrain, robot_spec, set_box
from jaxbiped.mission.log import Mark, MissionLog, Outline
from jaxbiped.report.video import paint, rendering

SIZE = (640, 480)  # [px]
COLOURS = {"obstacle": (0.80, 0.30, 0.27, 1), "bump": (0.45, 0.66, 0.90, 1), "gate": (0.62, 0.45, 0.78, 1)}
RED, BLUE = (0.9, 0.15, 0.12, 1), (0.05, 0.30, 0.95, 1)
FLAT = 0.002  # [m] thickness of a landmark
AWAY, ELEVATION, SIDE = 0.85, -16.0, 125.0  # [m], [deg] of the camera, and [deg] from the robot's heading
SEEN_THROUGH = 0.45  # opacity of walls and lintels in front of the robot


def scene_model(log: MissionLog, robot: RobotModelConfig) -> mujoco.MjModel:
    """The robot, the boxes of its scene in the colours of maps, and the landmarks; it is not simulated."""
    spec = add_terrain(robot_spec(robot), len(log.outlines))
    paint(spec)
    for k, mark in enumerate(log.landmarks):
        add_mark(spec, k, mark)
    model = spec.compile()
    for k, outline in enumerate(log.outlines):
        stand(model, k, outline)
    model.vis.global_.offwidth, model.vis.global_.offheight = SIZE
    model.vis.quality.shadowsize, model.vis.headlight.ambient[:], model.vis.headlight.diffuse[:] = 4096, 0.45, 0.5
    model.stat.extent, model.stat.center[:] = 1.0, (0.9, 0.7, 0.1)
    return model


def add_mark(spec: mujoco.MjSpec, number: int, mark: Mark) -> None:
    """One landmark, flat on the floor."""
    disc = mark.kind == "circle"
    spec.worldbody.add_geom(
        name=f"mark_{number}", type=mujoco.mjtGeom.mjGEOM_CYLINDER if disc else mujoco.mjtGeom.mjGEOM_BOX,
        size=(DISC_RADIUS, FLAT / 2, 0) if disc else (SQUARE_SIDE / 2, SQUARE_SIDE / 2, FLAT / 2),
        pos=(*mark.xy, FLAT / 2), quat=(np.cos(mark.yaw / 2), 0, 0, np.sin(mark.yaw / 2)), rgba=RED if disc else BLUE,
        contype=0, conaffinity=0,
    )  # fmt: skip


def stand(model: mujoco.MjModel, slot: int, outline: Outline) -> None:
    """Put one box of the scene into a slot, in its colour."""
    corners = np.asarray(outline.corners_xy)
    along, across = corners[1] - corners[0], corners[3] - corners[0]
    half = (float(np.linalg.norm(along)) / 2, float(np.linalg.norm(across)) / 2)
    yaw = float(np.arctan2(along[1], along[0]))
    x, y = corners.mean(axis=0)
    set_box(model, slot, (float(x), float(y)), yaw, half, outline.bottom, outline.top)
    model.geom(f"box_{slot}").rgba = COLOURS[outline.kind]


def photographs(
    log: MissionLog, robot: RobotModelConfig, frames: list[int], *, through: bool = False, side: float = SIDE
) -> list[Image.Image]:
    """Pictures of some states of `log.walk`, each from beside the robot.

    Args:
      frames: their numbers.
      through: whether walls and lintels are transparent.
      side: [deg] of the camera's direction from the robot's heading.

    Raises:
      InputError: OpenGL is not available.
    """
    model, states = scene_model(log, robot), log.walk.qpos
    data, option = mujoco.MjData(model), mujoco.MjvOption()
    if through:
        for k, outline in enumerate(log.outlines):
            if outline.kind != "bump":
                model.geom(f"box_{k}").rgba[3] = SEEN_THROUGH
    viewport, pixels = mujoco.MjrRect(0, 0, *SIZE), np.empty((SIZE[1], SIZE[0], 3), np.uint8)
    found = []
    with rendering(model, SIZE) as (scene, context):
        scene.flags[mujoco.mjtRndFlag.mjRND_HAZE] = False
        for number in frames:
            data.qpos[:] = states[number]
            mujoco.mj_forward(model, data)
            mujoco.mjv_updateScene(
                model, data, option, None, beside(states[number], side), mujoco.mjtCatBit.mjCAT_ALL, scene
            )
            mujoco.mjr_render(viewport, scene, context)
            mujoco.mjr_readPixels(pixels, None, viewport, context)
            found.append(Image.fromarray(np.flipud(pixels).copy()))
    return found


def beside(qpos: Float32[np.ndarray, "19"], side: float) -> mujoco.MjvCamera:
    """A camera that looks at the robot."""
    w, x, y, z = (float(v) for v in qpos[3:7])
    heading = np.degrees(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
    camera = mujoco.MjvCamera()
    camera.distance, camera.azimuth, camera.elevation = AWAY, heading + side, ELEVATION
    camera.lookat[:] = float(qpos[0]), float(qpos[1]), 0.17
    return camera


def frames_of(log: MissionLog, action: str) -> list[int]:
    """Numbers of the states during the first action of a name; none if it is not in the log."""
    held = [k for k, name in enumerate(log.action[1:]) if name == action][:1]  # it is done from moment k to the next
    return [n for n, moment in enumerate(log.walk.moment) if int(moment) in held]


def nearest_to(log: MissionLog, kind: str) -> tuple[int, float]:
    """Number of the state in which the hips are nearest to the middle of a box of a kind, and that distance [m].

    Raises:
      ValueError: there is no such box.
    """
    middles = np.array([np.mean(outline.corners_xy, axis=0) for outline in log.outlines if outline.kind == kind])
    away = np.linalg.norm(log.walk.qpos[:, None, :2] - middles, axis=2).min(axis=1)
    return int(away.argmin()), float(away.min())
