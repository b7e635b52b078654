"""The record of one mission, step by step, on the host: for pictures, films and printed logs. Plain NumPy."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Int, Int8, UInt8

SHORTEST = 1e-3  # [m] a shorter path counts as none, as in `arenas.moving_boxes`
KINDS = ("obstacle", "bump", "gate")  # of an outline
MARKS = ("circle", "square")  # of a landmark


@dataclass(frozen=True)
class Outline:
    """The plan view of one true box."""

    corners_xy: Float[np.ndarray, "4 2"]  # [m] in order around the box
    kind: str  # one of KINDS
    bottom: float = 0.0  # [m] height of its underside
    top: float = 0.0  # [m] height of its top
    way: tuple[float, float, float, float] | None = None  # if it moves: dx, dy, speed, phase of `arenas.moving_boxes`

    def moved(self, time: float) -> tuple[float, float]:
        """Its displacement (x, y) [m] from its corners at a time [s] of the mission."""
        if self.way is None:
            return 0.0, 0.0
        dx, dy, speed, phase = self.way
        length = math.hypot(dx, dy)
        part = 1.0 - abs((phase + (speed * time / length if length > SHORTEST else 0.0)) % 2.0 - 1.0)
        return part * dx, part * dy


@dataclass(frozen=True)
class Mark:
    """One landmark on the floor."""

    xy: tuple[float, float]  # [m] centre
    yaw: float  # [rad]; meaningless for a circle
    kind: str  # one of MARKS


@dataclass(frozen=True)
class Ground:
    """True terrain, as in `geometry.height_field.HeightField`."""

    heights: Float32[np.ndarray, "P Q"]  # [m]; NaN in holes
    origin_xy: Float[np.ndarray, "2"]  # [m] of heights[0, 0]
    pitch: float  # [m]


@dataclass(frozen=True)
class Picture:
    """The picture of one measurement."""

    left: UInt8[np.ndarray, "h w 3"]  # the left camera's image
    disparity: Float32[np.ndarray, "h w"]  # [px]; 0 where nothing was measured


@dataclass(frozen=True)
class Walk:
    """How a simulated biped moved: `F` states of `biped.model.robot_spec`, in their order."""

    qpos: Float32[np.ndarray, "F 19"]  # hips (x, y, z) [m], their quaternion (w, x, y, z), 12 joint angles [rad]
    moment: Float32[np.ndarray, "F"]  # when, in moments of the log: 2.5 is half way from the third to the fourth


@dataclass(frozen=True)
class MissionLog:
    """`T` moments of one mission: the first before any action, then one after each action.

    `classes`, `levels` and `plan` are what the robot believed at that moment, in the world frame.
    """

    classes: Int8[np.ndarray, "T H W"]  # `Cell` of each cell
    levels: Int8[np.ndarray, "T H W"]  # level of the ground
    true_xyyaw: Float[np.ndarray, "T 3"]  # [m, m, rad] true pose
    estimated_xyyaw: Float[np.ndarray, "T 3"]  # [m, m, rad] believed pose
    plan: tuple[Float[np.ndarray, "n 2"], ...]  # T paths ahead [m], each from 0 points (no path) up
    time: Float[np.ndarray, "T"]  # [s] since the start
    action: tuple[str, ...]  # T names of the preceding actions, "Start" for the first
    pitch: float  # [m]
    origin_xy: Float[np.ndarray, "2"]  # [m] outer corner of cell (0, 0)
    size_xy: Float[np.ndarray, "2"]  # [m] of the arena, from (0, 0)
    goal_xy: Float[np.ndarray, "2"]  # [m]
    outlines: tuple[Outline, ...] = ()  # true boxes
    landmarks: tuple[Mark, ...] = ()
    pictures: tuple[Picture, ...] = ()  # T pictures of the last measurements; none without a rendered camera
    outcome: str = ""  # how it ended, such as "reached"
    true_z: Float[np.ndarray, "T"] | None = None  # [m] height of the ground that the robot stood on
    squat: Bool[np.ndarray, "T"] | None = None  # its stance
    seen: Int[np.ndarray, "T"] | None = None  # landmarks seen in the last measurement
    points: tuple[Float32[np.ndarray, "_ 3"], ...] = ()  # T clouds [m] of the last measurements, believed world frame
    voxels: Bool[np.ndarray, "T H W Z"] | None = None  # occupied; k: (k - 1/2) to (k + 1/2) `level_height`
    level_height: float = 0.03  # [m]
    walk: Walk | None = None  # of a simulated biped
    terrain: Ground | None = None

    def __post_init__(self):
        count = len(self.time)
        for name in ("classes", "levels", "true_xyyaw", "estimated_xyyaw", "plan", "action"):
            if len(getattr(self, name)) != count or count == 0:
                raise ValueError(f"{name} has {len(getattr(self, name))} moments, time has {count}; at least 1 each")
        for name in ("pictures", "points", "true_z", "squat", "seen", "voxels"):
            held = getattr(self, name)
            if held is not None and len(held) not in (0, count):
                raise ValueError(f"{name} has {len(held)} moments, time has {count}; as many, or none")
