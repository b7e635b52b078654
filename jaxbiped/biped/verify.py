"""Many trials of one primitive at once, in any backend: like `trial.play`, but batched and with more measurements.

Each simulation of the batch has its own disturbance: its friction, masses, gravity and boxes are fields of the model,
its servo offsets are in its control table. The robot carries instruments: poses of the soles, force sensors in the
ankles, the torques of the servos.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int

from jaxbiped import physics
from jaxbiped.biped.config import GRAVITY, JOINT_NAMES, SIDES, RobotModelConfig
from jaxbiped.biped.gait import PrimitiveTable, home_table
from jaxbiped.biped.model import add_terrain, home_qpos, robot_spec
from jaxbiped.biped.trial import (
    SETTLE,
    WINDOW,
    Disturbance,
    Tolerance,
    boxes_of,
    ground_after,
    lay_out,
    middle_of,
    passes_gate,
    relative,
)
from jaxbiped.physics.backend import Backend, Rollout

VARIED = ("geom_friction", "body_mass", "body_inertia", "opt.gravity", "geom_pos", "geom_size", "geom_quat")
ROOM = 40_000_000  # most numbers recorded for one block of trials: 320 MB
SLOTS = 24  # contacts of a simulation that MJX keeps; more make it invalid, which is detected
BEARING = 0.02  # share of the robot's weight from which a foot counts as loaded
LANDING = 0.1  # [s] after touch-down, from which a foot's movement on the ground counts as slip
EVERY = 2  # steps between two evaluations of the zero moment point


@dataclass(frozen=True)
class Trials:
    """The outcome of each trial, [B]. Errors are in the frame of the start, actual minus requested.

    Values that need records of every step are NaN if these were not requested.
    """

    error: Float[np.ndarray, "B 3"]  # (x, y) [m] and yaw [rad] of the midpoint of the feet
    height: Float[np.ndarray, "B"]  # [m] largest distance of a sole from its ground
    tilt: Float[np.ndarray, "B"]  # [rad] of the torso at the end
    touched: Bool[np.ndarray, "B"]  # whether head or torso touched anything at any time
    warnings: Int[np.ndarray, "B"]  # of the engine; any of them makes a trial invalid, and its other numbers NaN
    slip: Float[np.ndarray, "B"]  # [m] largest movement of a foot on the ground between two swings
    zmp_margin: Float[np.ndarray, "B"]  # [m] smallest, from the forces on the feet; -inf in the air
    peak_torque: Float[np.ndarray, "B"]  # [Nm] of any servo
    peak_speed: Float[np.ndarray, "B"]  # [rad/s] of any joint
    energy: Float[np.ndarray, "B"]  # [J] work done by the servos, without braking
    head_clearance: Float[np.ndarray, "B"]  # [m] smallest, of the head under the lintel; NaN if there is none
    sway: Float[np.ndarray, "B"]  # [m] largest distance of the head's middle from the line between start and end

    def fell(self, tolerance: Tolerance) -> Bool[np.ndarray, "B"]:
        """Whether it is not upright on the ground that it should stand on, or not valid."""
        upright = (self.tilt <= tolerance.upright) & (self.height <= tolerance.height)
        return ~upright | (self.warnings > 0)

    def slipped(self, tolerance: Tolerance) -> Bool[np.ndarray, "B"]:
        """Whether it is upright, but in the wrong place."""
        near = np.hypot(self.error[:, 0], self.error[:, 1]) <= tolerance.placement
        return ~self.fell(tolerance) & ~(near & (np.abs(self.error[:, 2]) <= tolerance.yaw))

    def success(self, tolerance: Tolerance) -> Bool[np.ndarray, "B"]:
        """Whether it is upright, has both feet where they should be, and touched nothing."""
        return ~self.fell(tolerance) & ~self.slipped(tolerance) & ~self.touched


def trial_spec(robot: RobotModelConfig, boxes: int) -> mujoco.MjSpec:
    """The robot with its instruments, on a floor with boxes."""
    spec = add_terrain(robot_spec(robot), boxes)
    spec.add_numeric(name="max_contact_points", data=[SLOTS])

    def sense(name: str, kind: str, what: str, of: mujoco.mjtObj) -> None:
        sensor = spec.add_sensor(name=name, type=getattr(mujoco.mjtSensor, f"mjSENS_{kind}"))
        sensor.objtype, sensor.objname = of, what

    site = mujoco.mjtObj.mjOBJ_SITE
    for side in SIDES:
        for name, kind in (("pos", "FRAMEPOS"), ("ahead", "FRAMEXAXIS"), ("left", "FRAMEYAXIS")):
            sense(f"{name}_{side}", kind, f"sole_{side}", site)
        for kind in ("FORCE", "TORQUE"):
            sense(f"{kind.lower()}_{side}", kind, f"sole_{side}", site)
    sense("up", "FRAMEZAXIS", "head_top", site)
    sense("head", "FRAMEPOS", "head_top", site)
    for name in JOINT_NAMES:
        sense(f"servo_{name}", "ACTUATORFRC", name, mujoco.mjtObj.mjOBJ_ACTUATOR)
    return spec


def trials(
    table: PrimitiveTable,
    robot: RobotModelConfig,
    disturbances: Sequence[Disturbance],
    backend: str = "native",
    *,
    record: bool = True,
    **options: object,
) -> Trials:
    """Stand, play the primitive, stand again, once for each disturbance.

    Args:
      backend: name for `physics.make`, which gets `options`.
      record: measure what needs a record of every step; otherwise only where the robot ends.

    Raises:
      InputError: an unknown backend, or something that it rejects.
    """
    steps = len(table.ctrl) + 2 * round(SETTLE / table.timestep)
    width = 80 if record else 4
    size = min(len(disturbances), max(1, ROOM // (steps * width)))
    boxes = boxes_of(table.request, *disturbances)
    spec = trial_spec(robot, boxes)
    watch = {"limbs": tuple((part, f"box_{k}") for part in ("head", "torso") for k in range(boxes))} if boxes else {}
    made = physics.make(backend, spec, size, watch=watch, fields=VARIED, free_joint=True, **options)
    parts = []
    for begin in range(0, len(disturbances), size):
        block = list(disturbances[begin : begin + size])
        padded = block + block[-1:] * (size - len(block))
        rollout = roll(made, table, robot, padded, record)
        measured = measure(made, rollout, table, robot, padded, record)
        parts.append({f.name: getattr(measured, f.name)[: len(block)] for f in fields(Trials)})
    return Trials(**{f.name: np.concatenate([part[f.name] for part in parts]) for f in fields(Trials)})


def roll(
    backend: Backend, table: PrimitiveTable, robot: RobotModelConfig, disturbances: Sequence[Disturbance], record: bool
) -> Rollout:
    """Play the primitive in a batch of prepared worlds; records of every step, or of a few with start and end."""
    home, rest = home_table(robot, table.request.squat_start), round(SETTLE / table.timestep)
    before, after = np.tile(home.ctrl[-1], (rest, 1)), np.tile(table.ctrl[-1], (rest, 1))
    control = np.concatenate([before, table.ctrl, after])
    qpos = np.empty((len(disturbances), backend.model.nq))
    values: dict[str, list[np.ndarray]] = {name: [] for name in VARIED}
    for b, disturbance in enumerate(disturbances):
        model = copy.copy(backend.model)
        ground = lay_out(model, table, robot, disturbance)
        qpos[b] = home_qpos(model, home.pelvis[-1] + [0, 0, ground], home.q[-1])
        for name in VARIED:
            owner, key = (model.opt, name[4:]) if name.startswith("opt.") else (model, name)
            values[name].append(np.array(getattr(owner, key)))
    offsets = np.array([d.servo for d in disturbances])
    every = 1 if record else math.gcd(rest, len(control))
    return backend.rollout(
        control + offsets[:, None], qpos, fields={k: np.stack(v) for k, v in values.items()}, record_every=every
    )


def measure(
    backend: Backend,
    rollout: Rollout,
    table: PrimitiveTable,
    robot: RobotModelConfig,
    disturbances: Sequence[Disturbance],
    record: bool,
) -> Trials:
    """Read the instruments."""
    read = lambda name: rollout.sensordata[..., address(backend.model, name)]  # noqa: E731
    request, count = table.request, len(disturbances)
    every = round(rollout.time[0] / table.timestep)
    begin = round(SETTLE / table.timestep) // every - 1
    soles = np.stack([read(f"pos_{side}") for side in SIDES], axis=2)  # [B, R, 2, 3]
    moved = relative(middle_of(soles[:, -1]), middle_of(soles[:, begin]))
    expected = np.array([ground_after(request, d) for d in disturbances])
    out = {
        "error": moved - [request.forward, request.left, request.turn],
        "height": np.abs(soles[:, -1, :, 2] - expected[:, None]).max(axis=1),
        "tilt": np.arccos(np.clip(read("up")[:, -1, 2], -1, 1)),
        "touched": rollout.touched.any(axis=1),
        "warnings": rollout.warnings.sum(axis=1),
    }
    blank = np.full(count, np.nan)
    names = ("slip", "zmp_margin", "peak_torque", "peak_speed", "energy", "head_clearance", "sway")
    if not record:
        return Trials(**out, **dict.fromkeys(names, blank))
    torque = np.concatenate([read(f"servo_{name}") for name in JOINT_NAMES], axis=-1)[:, begin + 1 :]
    speed = rollout.qvel[:, begin + 1 :, 6:]
    head = read("head")[:, begin + 1 :]
    way = soles[:, -1, :, :2].mean(axis=1) - soles[:, begin, :, :2].mean(axis=1)
    start = soles[:, begin, :, :2].mean(axis=1)
    return Trials(
        **out,
        slip=slip(soles[:, begin + 1 :, :, :2], table),
        zmp_margin=zmp_margin(read, soles, robot, np.array([d.mass for d in disturbances]))[:, begin + 1 :].min(axis=1),
        peak_torque=np.abs(torque).max(axis=(1, 2)),
        peak_speed=np.abs(speed).max(axis=(1, 2)),
        energy=np.maximum(torque * speed, 0.0).sum(axis=(1, 2)) * table.timestep,
        head_clearance=clearance(head, table, robot, disturbances) if passes_gate(request) else blank,
        sway=sway(head[..., :2], start, way),
    )


def address(model: mujoco.MjModel, name: str) -> np.ndarray:
    """Columns of a sensor."""
    sensor = model.sensor(name)
    return np.arange(int(sensor.adr[0]), int(sensor.adr[0] + sensor.dim[0]))


def slip(soles: Float[np.ndarray, "B R 2 2"], table: PrimitiveTable) -> Float[np.ndarray, "B"]:
    """Largest movement [m] of a foot on the ground between two swings."""
    still = np.abs(np.diff(table.feet, axis=0)).max(axis=2) < 1e-7
    furthest = np.zeros(len(soles))
    for s in range(2):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], still[:, s], [False]]).astype(int)))
        for k, (down, up) in enumerate(edges.reshape(-1, 2)):
            landed = down + round(LANDING / table.timestep) if k else down
            if landed < up:
                path = soles[:, landed : up + 1, s] - soles[:, landed, None, s]
                furthest = np.maximum(furthest, np.hypot(path[..., 0], path[..., 1]).max(axis=1))
    return furthest


def zmp_margin(read, soles, robot: RobotModelConfig, mass: Float[np.ndarray, "B"]) -> Float[np.ndarray, "B N"]:
    """Distance [m] of the zero moment point from the edge of the hull of the loaded soles; -inf in the air.

    As a robot measures it: each ankle's force sensor, minus the foot's own weight, gives position and size of the
    foot's load. Forces are summed over 50 ms, because contacts of a simulation chatter. The result holds +inf where it
    was not evaluated.
    """
    records = soles.shape[1]
    weight = GRAVITY * robot.masses.total * mass
    total, corners, bears = 0.0, [], []
    half = np.array([robot.proportions.foot_length, robot.proportions.foot_width]) / 2
    for s, side in enumerate(SIDES):
        up = (GRAVITY * robot.masses.foot * mass)[:, None] - read(f"force_{side}")[..., 2]
        moment = -read(f"torque_{side}")
        ahead, left = read(f"ahead_{side}")[..., :2], read(f"left_{side}")[..., :2]
        bearing = soles[:, :, s, :2] * up[..., None] - moment[..., 1, None] * ahead + moment[..., 0, None] * left
        window = windowed(np.concatenate([up[..., None], bearing], axis=-1))[:, ::EVERY]
        total = total + window
        bears.append(window[..., 0] > BEARING * WINDOW * weight[:, None])
        for x, y in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            corners.append((soles[:, :, s, :2] + x * half[0] * ahead + y * half[1] * left)[:, ::EVERY])
    point = total[..., 1:] / np.where(total[..., :1] > 0, total[..., :1], 1.0)
    offsets = np.stack(corners, axis=2) - point[:, :, None]
    on_ground = np.repeat(np.stack(bears, axis=2), 4, axis=2)
    least = np.full(point.shape[:2], np.inf)
    for angle in np.arange(72) * (2 * np.pi / 72):
        reach = offsets[..., 0] * math.cos(angle) + offsets[..., 1] * math.sin(angle)
        least = np.minimum(least, np.where(on_ground, reach, -np.inf).max(axis=2))
    margin = np.full((len(soles), records), np.inf)
    margin[:, ::EVERY] = np.where(on_ground.any(axis=2), least, -np.inf)
    return margin


def windowed(values: Float[np.ndarray, "B R c"]) -> Float[np.ndarray, "B R c"]:
    """Sums over the last `WINDOW` records, fewer at the beginning."""
    sums = np.cumsum(values, axis=1)
    sums[:, WINDOW:] -= sums[:, :-WINDOW].copy()
    return sums


def clearance(
    head: Float[np.ndarray, "B R 3"],
    table: PrimitiveTable,
    robot: RobotModelConfig,
    disturbances: Sequence[Disturbance],
) -> Float[np.ndarray, "B"]:
    """Smallest height [m] between the camera's top and the lintel's bottom, while it is below or within 5 cm of it."""
    lintel = np.array([d.clearance for d in disturbances])[:, None]
    middle = table.request.forward / 2 + home_table(robot, False).pelvis[-1, 0]
    half = max(0.004, table.request.forward / 2 - 0.05)
    below = np.abs(head[..., 0] - middle) < half + 0.015
    return np.where(below, lintel - head[..., 2], np.inf).min(axis=1)


def sway(
    head: Float[np.ndarray, "B R 2"], start: Float[np.ndarray, "B 2"], way: Float[np.ndarray, "B 2"]
) -> Float[np.ndarray, "B"]:
    """Largest lateral distance [m] of the head from the straight path."""
    length = np.hypot(way[:, 0], way[:, 1])
    ahead = np.where(length[:, None] > 1e-3, way / np.maximum(length, 1e-3)[:, None], [1.0, 0.0])
    off = head - start[:, None]
    return np.abs(off[..., 1] * ahead[:, None, 0] - off[..., 0] * ahead[:, None, 1]).max(axis=1)
