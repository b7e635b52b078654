"""One primitive, played once in C MuJoCo under a disturbance, and its outcome."""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from jaxbiped.biped.config import GRAVITY, JOINTS, SIDES, RobotModelConfig
from jaxbiped.biped.gait import PrimitiveTable, home_table
from jaxbiped.biped.model import add_terrain, home_qpos, part_geoms, robot_spec, set_box
from jaxbiped.biped.request import Request
from jaxbiped.config import Model

SETTLE = 0.4  # [s] standing time before and after the primitive
WINDOW = 10  # steps (50 ms) over which contact forces are averaged, less than the pendulum's time constant


RIMS = ("up ahead", "up aside", "down ahead", "down aside")  # of one step's height, ahead or to the left
STEP = 0.03  # [m] height of a rim


@dataclass(frozen=True)
class Disturbance:
    """Deviations from the nominal conditions of a primitive; by default none."""

    friction: float = 0.8
    mass: float = 1.0  # factor on all masses
    rise: float = 0.0  # [m] by which the bump is higher than known
    edge: float = 0.0  # [m] by which the edge is farther away than the nominal one
    yaw: float = 0.0  # [rad] rotation of the edge, or of the gate
    lateral: float = 0.0  # [m] offset of the gate to the left
    servo: tuple[float, ...] = (0.0,) * (2 * len(JOINTS))  # [rad] zero offset of each servo
    slope: float = 0.0  # [rad] slope of all ground, rising ahead
    clearance: float = 0.37  # [m] height under the gate's lintel
    rim: str = ""  # one of RIMS: an edge unknown to the primitive, `edge` [m] from the robot's start


class Tolerance(Model):
    """Conditions for the success of a primitive."""

    placement: float = 0.010
    """[m] Position error of the midpoint of the feet."""
    yaw: float = math.radians(10.0)
    """[rad]"""
    height: float = 0.005
    """[m] Distance of each sole from the ground that it should stand on."""
    upright: float = math.radians(10.0)
    """[rad] Final angle of the torso from the vertical of the ground."""


@dataclass(frozen=True)
class Outcome:
    """The final state of the robot; error in the frame of the start, actual minus requested."""

    error: np.ndarray  # [3] (x, y) [m] and yaw [rad] of the midpoint of the feet
    height: float  # [m] largest distance of a sole from its ground
    tilt: float  # [rad] of the torso at the end
    head_contact: bool  # of head or torso with anything, at any time
    warnings: int  # of the engine
    zmp_margin: float  # [m] smallest, from contact forces; NaN if not recorded
    peak_torque: float  # [Nm] of any servo
    peak_speed: float  # [rad/s] of any joint

    def success(self, tolerance: Tolerance) -> bool:
        """Whether it is upright, has both feet where they should be, and touched nothing."""
        return bool(
            np.hypot(*self.error[:2]) <= tolerance.placement
            and abs(self.error[2]) <= tolerance.yaw
            and self.height <= tolerance.height
            and self.tilt <= tolerance.upright
            and not self.head_contact
            and self.warnings == 0
        )


def nominal_edge(request: Request, robot: RobotModelConfig) -> float:
    """Distance [m] ahead of the robot's middle where a step's edge should be: half way between the limits.

    Up, the toes must stand before it and the foot's middle end beyond it; down, the foot's middle must stand before
    it and the heels end beyond it.
    """
    half = robot.proportions.foot_length / 2
    return (half + request.forward) / 2 if request.rise > 0 else (request.forward - half) / 2


def passes_gate(request: Request) -> bool:
    """Whether a primitive squats, walks and stands up: its trials have a gate."""
    return request.squat and not request.squat_start and not request.squat_end


def boxes_of(request: Request, *disturbances: Disturbance) -> int:
    """Number of boxes in trials of a primitive: a bump, or two posts and a lintel, or a rim."""
    return 1 if request.rise else 3 if passes_gate(request) else int(any(d.rim for d in disturbances))


def ground_after(request: Request, d: Disturbance) -> float:
    """Height [m] of the ground that the robot should stand on at the end."""
    if d.rim:
        return STEP if d.rim.startswith("down") else 0.0
    return request.rise + d.rise if request.rise > 0 else 0.0


def lay_out(model: mujoco.MjModel, table: PrimitiveTable, robot: RobotModelConfig, d: Disturbance) -> float:
    """Write a primitive's terrain and a disturbance into a freshly compiled model; returns the start's ground [m]."""
    request, start = table.request, 0.0
    for part in ("foot_left", "foot_right"):
        model.geom_friction[part_geoms(model, part), 0] = d.friction
    model.body_mass *= d.mass
    model.body_inertia *= d.mass
    model.opt.gravity[:] = -GRAVITY * math.sin(d.slope), 0.0, -GRAVITY * math.cos(d.slope)
    half = 0.5
    heading = np.array([math.cos(d.yaw), math.sin(d.yaw)])
    if d.rim:
        up, side = d.rim.startswith("up"), np.array([0.0, 1.0] if d.rim.endswith("aside") else [1.0, 0.0])
        start = 0.0 if up else STEP
        set_box(model, 0, tuple((d.edge + (half if up else -half)) * side), 0.0, (half, half), -0.1, STEP)
    elif request.rise:
        edge = np.array([nominal_edge(request, robot) + d.edge, 0.0])
        sign = math.copysign(1.0, request.rise)
        height = abs(request.rise) + sign * d.rise
        start = height if request.rise < 0 else 0.0
        set_box(model, 0, tuple(edge + sign * half * heading), d.yaw, (half, half), -0.1, height)
    elif passes_gate(request):
        head = home_table(robot, False).pelvis[-1, 0]  # which is not above the midpoint of the feet
        middle, side = np.array([request.forward / 2 + head, d.lateral]), 0.16
        thick = max(
            0.004, request.forward / 2 - 0.05
        )  # 5 cm clear of the head at both ends, if the path is long enough
        across = side * np.array([-heading[1], heading[0]])
        for slot, place in enumerate((middle + across, middle - across)):
            set_box(model, slot, tuple(place), d.yaw, (thick, 0.02), 0.0, d.clearance)
        set_box(model, 2, tuple(middle), d.yaw, (thick, side), d.clearance, d.clearance + 0.04)
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return start


def play(table: PrimitiveTable, robot: RobotModelConfig, d: Disturbance | None = None, record: bool = False) -> Outcome:
    """Stand, play the primitive, stand again.

    Args:
      record: measure the zero moment point from contact forces, which takes most of the time.
    """
    d = d or Disturbance()
    model = add_terrain(robot_spec(robot), boxes_of(table.request, d)).compile()
    ground = lay_out(model, table, robot, d)
    data = mujoco.MjData(model)
    home = home_table(robot, table.request.squat_start)
    data.qpos[:] = home_qpos(model, home.pelvis[-1] + [0, 0, ground], home.q[-1])
    offset, rest = np.asarray(d.servo), round(SETTLE / model.opt.timestep)
    before, after = np.tile(home.ctrl[-1], (rest, 1)), np.tile(table.ctrl[-1], (rest, 1))
    controls = np.concatenate([before, table.ctrl, after]) + offset
    limbs = {*part_geoms(model, "head").tolist(), *part_geoms(model, "torso").tolist()}
    touched, margin, torque, speed, start = False, math.inf if record else math.nan, 0.0, 0.0, None
    recent: list[np.ndarray] = []
    foot_of = [-1] * model.ngeom
    for s, side in enumerate(SIDES):
        for g in part_geoms(model, f"foot_{side}"):
            foot_of[g] = s
    for k, control in enumerate(controls):
        data.ctrl[:] = control
        mujoco.mj_step(model, data)
        if k == rest - 1:
            start = stand(data)
        touched = touched or not limbs.isdisjoint(data.contact.geom.ravel().tolist())
        if k >= rest:
            torque = max(torque, np.abs(data.actuator_force).max())
            speed = max(speed, np.abs(data.qvel[6:]).max())
        if record and k >= rest:
            recent = [*recent[-WINDOW + 1 :], ground_force(model, data, foot_of)]
            margin = min(margin, contact_margin(data, robot, np.sum(recent, axis=0)))
    request, end = table.request, stand(data)
    moved = relative(end, start) - [request.forward, request.left, request.turn]
    height = max(abs(data.site(f"sole_{side}").xpos[2] - ground_after(request, d)) for side in SIDES)
    tilt = math.acos(min(1.0, max(-1.0, data.body("torso").xmat[8])))
    return Outcome(moved, height, tilt, touched, int(sum(w.number for w in data.warning)), margin, torque, speed)


def ground_force(model: mujoco.MjModel, data: mujoco.MjData, foot_of: list[int]) -> np.ndarray:
    """[2, 3] for the left and the right foot: upward force [N], and the force times x and times y [Nm].

    Args:
      foot_of: for each geom, 0 or 1 if it belongs to the left or the right foot, else -1.
    """
    force, feet = np.zeros(6), np.zeros((2, 3))
    for k, (one, other) in enumerate(data.contact.geom.tolist()):
        side = max(foot_of[one], foot_of[other])
        if side >= 0:
            mujoco.mj_contactForce(model, data, k, force)
            frame, (x, y, _) = data.contact.frame[k], data.contact.pos[k]
            up = abs(frame[2] * force[0] + frame[5] * force[1] + frame[8] * force[2])
            feet[side] += up, up * x, up * y
    return feet


def contact_margin(data: mujoco.MjData, robot: RobotModelConfig, feet: np.ndarray) -> float:
    """Distance [m] of the zero moment point from the edge of the hull of the loaded soles; -inf in the air.

    Args:
      feet: `ground_force`, summed over a short time, because single contacts of a simulation chatter.
    """
    bearing = [side for s, side in enumerate(SIDES) if feet[s, 0] > 1e-3]
    if not bearing:
        return -math.inf
    total = feet.sum(axis=0)
    half = np.array([robot.proportions.foot_length, robot.proportions.foot_width]) / 2
    corners = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]]) * half
    soles = [data.site(f"sole_{side}") for side in bearing]
    points = np.concatenate([site.xpos[:2] + corners @ site.xmat.reshape(3, 3)[:2, :2].T for site in soles])
    angles = np.arange(72) * (2 * np.pi / 72)
    normals = np.stack([np.cos(angles), np.sin(angles)])
    return float(((points - total[1:] / total[0]) @ normals).max(axis=0).min())


def stand(data: mujoco.MjData) -> np.ndarray:
    """[3] Position of the robot: the midpoint of its soles."""
    return middle_of(np.stack([data.site(f"sole_{side}").xpos for side in SIDES]))


def middle_of(soles: np.ndarray) -> np.ndarray:
    """[..., 3] (x, y, yaw) of the midpoint of two soles [..., 2, 2 or 3]: the left and the right."""
    left, right = soles[..., 0, :2], soles[..., 1, :2]
    across = left - right
    yaw = np.arctan2(-across[..., 0], across[..., 1])
    return np.concatenate([(left + right) / 2, yaw[..., None]], axis=-1)


def relative(pose: np.ndarray, frame: np.ndarray) -> np.ndarray:
    """[..., 3] A pose (x, y, yaw) in the frame of another."""
    c, s = np.cos(frame[..., 2]), np.sin(frame[..., 2])
    dx, dy, turn = (pose[..., k] - frame[..., k] for k in range(3))
    return np.stack([c * dx + s * dy, -s * dx + c * dy, (turn + math.pi) % (2 * math.pi) - math.pi], axis=-1)
