"""Simulated robots in their arenas: a batch of robots with their boxes, and the true state according to the engine."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Float64, Int

from jaxbiped import physics
from jaxbiped.biped.config import SIDES, RobotModelConfig
from jaxbiped.biped.gait import home_table
from jaxbiped.biped.model import FAR, add_terrain, home_qpos, part_geoms, robot_spec
from jaxbiped.geometry.boxes import Boxes

FIELDS = ("geom_pos", "geom_size", "geom_quat")  # fields that hold an arena's boxes
BODY = "body"  # watch of torso and head; those of the feet are named by box
HAIR = 1e-4  # [m] allowed penetration of a box by torso or head
BURIED = 0.1  # [m] depth of boxes below the floor: feet would slip through thin plates sideways
TOPPLED = math.cos(math.radians(45.0))  # cosine of the torso's tilt
LOWEST = 0.5  # fraction of the hips' squatting height below which a robot has fallen
KICK = 0.01  # [m] height above the allowed step that a foot may touch
EMPTY, NEVER = -1, -2  # of a slot: it has no box; nothing is written yet
MJX_BOXES = 4  # most box slots in MJX, where each possible contact costs time


@dataclass(frozen=True)
class Stands:
    """Poses of robots and of their bodies. NaN if a simulation is not valid."""

    feet: Float[np.ndarray, "n 4"]  # (x, y, z, yaw) [m, rad] of the midpoint of the soles
    body: Float[np.ndarray, "n 6"]  # (x, y, z, yaw, roll, pitch) of the robot frame to which the cameras are fixed


class Stage:
    """A batch of robots that walk in their own arenas.

    Events that end a mission are recorded while they move: `fell` and `collided` [S] stay set until a robot is placed
    again. It has fallen if its torso tilts by over 45 degrees or its hips are down. It has collided if torso or head
    press into a box, or a foot touches one that is too high above its ground to step on. Legs have no geoms: their
    contacts are not detected.
    """

    def __init__(self, name: str, size: int, boxes: Boxes, robot: RobotModelConfig, **options: Any):
        """
        Args:
          name: `native` or `mjx`; other options are those of `physics.make`.
          size: number of robots, S.
          boxes: boxes of all arenas [A, M], on the host. A robot in MJX meets at most the `MJX_BOXES` nearest of them.
        """
        most = boxes.x.shape[1]
        self.slots = min(most, MJX_BOXES) if name == "mjx" else most
        self.robot, self.boxes = robot, boxes
        self.arena = np.zeros(size, int)  # arena of each robot
        self.home = [home_table(robot, squatting) for squatting in (False, True)]
        spec = add_terrain(robot_spec(robot), self.slots)
        named = [f"box_{k}" for k in range(self.slots)]
        plain = spec.copy().compile()
        geoms = {part: [plain.geom(g).name for g in part_geoms(plain, part)] for part in ("foot", "torso", "head")}
        watch = {BODY: tuple((g, box) for g in geoms["torso"] + geoms["head"] for box in named)}
        watch |= {box: tuple((g, box) for g in geoms["foot"]) for box in named}
        self.backend = physics.make(name, spec, size, watch=watch, fields=FIELDS, **options)
        model = self.backend.model
        self.model, self.data = model, mujoco.MjData(model)
        self.ids = [model.geom(box).id for box in named]
        self.soles = [model.site(f"sole_{side}").id for side in SIDES]
        self.torso = model.body("torso").id
        self.fields = {field: np.tile(getattr(model, field), (size, 1, 1)) for field in FIELDS}
        self.held = np.full((size, self.slots), NEVER)  # which box of its arena each slot holds; EMPTY: none
        self.tops = np.full((size, self.slots), -np.inf)  # [m]
        self.ground, self.reach = np.zeros(
            (2, size)
        )  # [m] ground where each stood, and the highest top that its feet may touch
        self.fell, self.collided, self.changed = np.zeros((3, size), bool)
        self.work = np.zeros(size)  # [J] of all servos since each was placed, if the backend accumulates it
        self.state = None

    def rest(self, squat: bool) -> Float64[np.ndarray, "1 12"]:
        """Servo targets that hold a home posture."""
        return self.home[int(squat)].ctrl[-1:]

    def enter(
        self, mask: Bool[np.ndarray, "S"], arena: Int[np.ndarray, "S"], xyz_yaw: Float64[np.ndarray, "S 4"]
    ) -> None:
        """Place the robots of a mask in arenas, upright and at rest: midpoint of the feet [m] and yaw [rad]."""
        self.arena[mask], self.held[mask] = arena[mask], NEVER
        qpos = np.tile(self.model.qpos0, (len(mask), 1))
        pelvis, q = self.home[0].pelvis[-1], self.home[0].q[-1]
        for s in np.flatnonzero(mask):
            x, y, z, yaw = xyz_yaw[s]
            self.expect(s, xyz_yaw[s], 0.0)
            cos, sin = math.cos(yaw), math.sin(yaw)
            hips = [x + cos * pelvis[0] - sin * pelvis[1], y + sin * pelvis[0] + cos * pelvis[1], z + pelvis[2]]
            qpos[s] = home_qpos(self.model, np.array(hips), q, yaw)
        self.state = self.backend.reset(mask, qpos)
        self.fell[mask], self.collided[mask] = False, False
        self.work[mask] = 0.0

    def expect(self, s: int | np.integer, feet: Float64[np.ndarray, "4"], climb: float) -> None:
        """Announce a robot's next action, which begins at (x, y, z, yaw) and may climb this high [m].

        The nearest boxes take the slots. One that had a slot keeps it, so that its contacts continue unchanged.
        """
        self.ground[s], self.reach[s] = feet[2], feet[2] + climb + KICK
        near = nearest(self.boxes, self.arena[s], feet[:2], self.slots)
        fresh = [m for m in near if m not in self.held[s]]
        for k in range(self.slots):
            if self.held[s, k] not in near and (fresh or self.held[s, k] != EMPTY):
                self.held[s, k] = fresh.pop(0) if fresh else EMPTY
                self.place(s, k)

    def place(self, s: int | np.integer, k: int) -> None:
        """Write the box of a slot into its geom, or move the geom far below."""
        position, size, quaternion = (self.fields[field][s, self.ids[k]] for field in FIELDS)
        boxes, a, m = self.boxes, self.arena[s], self.held[s, k]
        self.changed[s] = True
        if m == EMPTY:
            position[:], size[:], quaternion[:] = (k, 0.0, -FAR), 0.01, (1.0, 0.0, 0.0, 0.0)
            self.tops[s, k] = -np.inf
            return
        yaw, top = boxes.yaw[a, m], boxes.top[a, m]
        bottom = boxes.bottom[a, m] if boxes.overhead[a, m] else -BURIED
        position[:] = boxes.x[a, m], boxes.y[a, m], (bottom + top) / 2
        size[:] = boxes.half_x[a, m], boxes.half_y[a, m], (top - bottom) / 2
        quaternion[:] = math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)
        self.tops[s, k] = top

    def play(self, controls: Float64[np.ndarray, "S T 12"], mask: Bool[np.ndarray, "S"] | None = None) -> None:
        """Step the robots of a mask (all if None), and record which fall or collide."""
        if self.changed.any():
            self.backend.set_fields(self.fields, self.changed)
            self.changed[:] = False
        self.state = state = self.backend.advance(controls, mask=mask)
        self.work += state.work.sum(axis=1)
        _, x, y, _ = state.qpos[:, 3:7].T
        upright = 1 - 2 * (x * x + y * y)
        tall = np.any(state.touched[:, 1:] & (self.tops > self.reach[:, None]), axis=1)
        self.collided |= state.valid & ((state.depth[:, 0] > HAIR) | tall) & ~self.fell
        low = state.qpos[:, 2] < self.ground + LOWEST * self.robot.stance.squatting
        self.fell |= state.valid & ((upright < TOPPLED) | low) & ~self.collided

    def stands(self, ids: Int[np.ndarray, "n"], squat: Bool[np.ndarray, "n"]) -> Stands:
        """The current poses of some robots.

        Args:
          squat: their stances, whose home posture is the reference of the body frame.
        """
        feet, body = np.full((len(ids), 4), np.nan), np.full((len(ids), 6), np.nan)
        for n, s in enumerate(ids):
            if not self.state.valid[s]:
                continue
            self.data.qpos[:] = self.state.qpos[s]
            mujoco.mj_kinematics(self.model, self.data)
            left, right = self.data.site_xpos[self.soles]
            across = left - right
            feet[n] = *(left + right) / 2, math.atan2(-across[0], across[1])
            R = self.data.xmat[self.torso].reshape(3, 3)
            body[n, :3] = self.data.xpos[self.torso] - R @ self.home[int(squat[n])].pelvis[-1]
            body[n, 3:] = math.atan2(R[1, 0], R[0, 0]), math.atan2(R[2, 1], R[2, 2]), math.asin(-R[2, 0])
        return Stands(feet, body)


def nearest(boxes: Boxes, a: int | np.integer, xy: Float64[np.ndarray, "2"], count: int) -> list[int]:
    """The boxes of arena a in use, at most `count`, nearest to a point first."""
    used = np.flatnonzero(boxes.used[a])
    if len(used) <= count:
        return used.tolist()
    cos, sin = np.cos(boxes.yaw[a, used]), np.sin(boxes.yaw[a, used])
    dx, dy = xy[0] - boxes.x[a, used], xy[1] - boxes.y[a, used]
    along = np.maximum(np.abs(cos * dx + sin * dy) - boxes.half_x[a, used], 0.0)
    across = np.maximum(np.abs(cos * dy - sin * dx) - boxes.half_y[a, used], 0.0)
    return used[np.argsort(np.hypot(along, across), kind="stable")[:count]].tolist()
