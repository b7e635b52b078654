"""The MJCF of the biped, and of the ground on which it walks."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from jaxbiped.biped.config import JOINTS, SIDES, RobotModelConfig, centres_of_mass

TIMESTEP = 0.005  # [s]: at 16 ms it slips or falls
SOLVER = {"iterations": 10, "ls_iterations": 20, "impratio": 10.0}
"""Enough iterations that more change nothing; impratio 10 keeps soft contacts from creeping (with 4 and 6 it falls)."""
MARGIN = 0.0001  # [m] early contact of the feet: without it all but one contact of a foot on a box flicker, and in
# the 25 s on one foot of a slow step down it turns by 4 degrees; with it, or half of it, by 0.01. No larger:
# in MJX it is added to the size (`engine.grow`), and an edge supports the foot that much earlier.
FAR = 100.0  # [m] depth of unused boxes below the ground
FEET, UPPER = 1, 2  # contact bits: feet meet floor and boxes, torso and head meet boxes, the robot never itself
AXES = {"yaw": (0, 0, 1), "roll": (1, 0, 0), "pitch": (0, 1, 0)}
DARK, LIGHT, RED = (0.15, 0.16, 0.2, 1), (0.85, 0.87, 0.9, 1), (0.75, 0.2, 0.15, 1)
PARTS = ("foot_left", "foot_right", "torso", "head")


def robot_spec(config: RobotModelConfig) -> mujoco.MjSpec:
    """The biped alone, in the air: compile it or add terrain to it.

    Free joint `root` at the midpoint of the hips; hinges `hip_yaw_left` .. `ankle_roll_right` in the order of
    `JOINT_NAMES`, each with a position servo of the same name; contact geoms whose names begin with one of `PARTS`;
    sites `sole_left`, `sole_right`, `camera_left`, `camera_right` (x ahead, z up), `head_top`.
    """
    spec = mujoco.MjSpec()
    spec.modelname = "biped"
    spec.compiler.degree = False
    option = spec.option
    option.timestep, option.gravity = TIMESTEP, (0, 0, -9.81)
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL
    for name, value in SOLVER.items():
        setattr(option, name, value)

    body, masses = config.proportions, config.masses
    centre = centres_of_mass(body)
    torso = spec.worldbody.add_body(name="torso", pos=(0, 0, config.stance.standing))
    torso.add_freejoint(name="root")
    _inertia(torso, masses.torso, centre[0], (0.08, 0.12, body.torso_top))
    _torso_geoms(torso, config)
    limits = config.limits().reshape(2, 6, 2)
    for s, side in enumerate(SIDES):
        sign = 1 - 2 * s
        thigh = torso.add_body(name=f"thigh_{side}", pos=(0, sign * body.hip_offset, 0))
        shank = thigh.add_body(name=f"shank_{side}", pos=(0, 0, -body.thigh))
        foot = shank.add_body(name=f"foot_{side}", pos=(0, 0, -body.shank))
        _inertia(thigh, masses.thigh, centre[1], (0.04, 0.04, body.thigh))
        _inertia(shank, masses.shank, centre[2], (0.04, 0.04, body.shank))
        _inertia(foot, masses.foot, centre[3], (body.foot_length, body.foot_width, body.ankle_height))
        for link, length in ((thigh, body.thigh), (shank, body.shank)):
            _skin(link, (0.016, 0.016, 0.5 * length), (0, 0, -0.5 * length), LIGHT)
        _foot_geoms(foot, side, config)
        for j, (joint, link) in enumerate(zip(JOINTS, (thigh, thigh, thigh, shank, foot, foot), strict=True)):
            _joint(spec, link, f"{joint}_{side}", AXES[joint.split("_")[1]], limits[s, j], config)
    return spec


def add_terrain(spec: mujoco.MjSpec, boxes: int = 0) -> mujoco.MjSpec:
    """Add the floor `floor` and `boxes` static boxes `box_0`.. to a spec, in place.

    The boxes are parked far below the ground. Bumps, walls and lintels are made from them by writing `geom_pos`,
    `geom_size` (half sizes) and `geom_quat` of a compiled model, in one simulation or in each of many. Returns the
    spec.
    """
    bits = {"contype": 0, "friction": (0.01, 0.005, 0.0001), "solref": (0.01, 1.0)}
    spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0, 0, 0.1), conaffinity=FEET,
                            rgba=(0.55, 0.6, 0.65, 1), **bits)  # fmt: skip
    for k in range(boxes):
        spec.worldbody.add_geom(name=f"box_{k}", type=mujoco.mjtGeom.mjGEOM_BOX, size=(0.01, 0.01, 0.01),
                                pos=(k, 0, -FAR), conaffinity=FEET | UPPER, rgba=RED, **bits)  # fmt: skip
    spec.worldbody.add_light(pos=(0, 0, 2), dir=(0.2, 0.1, -1), castshadow=True)
    return spec


def box_slots(model: mujoco.MjModel) -> np.ndarray:
    """Geom ids of the box slots, in order."""
    names = [model.geom(g).name for g in range(model.ngeom)]
    return np.array([g for g, name in enumerate(names) if name.startswith("box_")], int)


def set_box(
    model: mujoco.MjModel, slot: int, centre_xy: tuple[float, float], yaw: float, half_xy: tuple[float, float],
    bottom: float, top: float,
) -> None:  # fmt: skip
    """Place box `slot` of a compiled model: [m] and [rad] in the world."""
    geom = model.geom(f"box_{slot}")
    geom.pos = (*centre_xy, 0.5 * (bottom + top))
    geom.size = (*half_xy, 0.5 * (top - bottom))
    geom.quat = (np.cos(yaw / 2), 0, 0, np.sin(yaw / 2))
    # The engine finds pairs in a bounding volume hierarchy; both of these are computed only when the model is compiled.
    model.geom_rbound[geom.id] = np.linalg.norm(model.geom_size[geom.id])
    model.geom_aabb[geom.id] = (0, 0, 0, *model.geom_size[geom.id])
    mujoco.mj_setConst(model, mujoco.MjData(model))


def part_geoms(model: mujoco.MjModel, part: str) -> np.ndarray:
    """Ids of the contact geoms of one of `PARTS`."""
    names = [model.geom(g).name for g in range(model.ngeom)]
    return np.array([g for g, name in enumerate(names) if name == part or name.startswith(f"{part}_")], int)


def home_qpos(model: mujoco.MjModel, pelvis: np.ndarray, q: np.ndarray, yaw: float = 0.0) -> np.ndarray:
    """State `qpos` [nq] of an upright robot: hips at `pelvis` [3], joints `q` [12]."""
    qpos = np.zeros(model.nq)
    qpos[:3], qpos[3:7], qpos[7:] = pelvis, (np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)), q
    return qpos


def _inertia(body, mass: float, height: float, size: tuple[float, float, float]) -> None:
    """Mass and inertia of a homogeneous box of a given size whose centre is `height` above the body's origin."""
    squares = np.square(size)
    body.mass, body.ipos, body.inertia = mass, (0, 0, height), mass / 12 * (squares.sum() - squares)
    body.explicitinertial = True


def _skin(body, half: Sequence[float | int], pos: Sequence[float | int], rgba) -> None:
    """A visual box without contacts."""
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=half, pos=pos, rgba=rgba, contype=0, conaffinity=0, mass=0)


def _torso_geoms(torso, config: RobotModelConfig) -> None:
    body = config.proportions
    radius, half = 0.04, 0.02
    middle, lens = 0.6 * body.torso_top, 0.015
    _skin(torso, (0.04, 0.06, 0.5 * body.torso_top), (0, 0, 0.5 * body.torso_top), LIGHT)
    _skin(torso, (0.01, 0.01, 0.5 * (body.camera_top - body.torso_top)),
          (0, 0, 0.5 * (body.camera_top + body.torso_top)), DARK)  # fmt: skip
    across = {"type": mujoco.mjtGeom.mjGEOM_CAPSULE, "contype": UPPER, "conaffinity": 0, "mass": 0}
    torso.add_geom(name="torso", fromto=(0, -half, middle, 0, half, middle), size=(radius, 0, 0), rgba=LIGHT, **across)
    height, reach = body.camera_top - lens, 0.5 * body.camera_baseline
    torso.add_geom(name="head", fromto=(0, -reach, height, 0, reach, height), size=(lens, 0, 0), rgba=DARK, **across)
    for side, sign in (("left", 1), ("right", -1)):
        torso.add_site(name=f"camera_{side}", pos=(lens, sign * reach, height))
    torso.add_site(name="head_top", pos=(0, 0, body.camera_top))


def _foot_geoms(foot, side: str, config: RobotModelConfig) -> None:
    body, contact = config.proportions, config.contact
    bits = {"contype": FEET, "conaffinity": 0, "mass": 0, "friction": (contact.friction, 0.005, 0.0001), "priority": 1,
            "condim": 3, "margin": MARGIN, "solref": (0.01, 1.0), "rgba": DARK}  # fmt: skip
    half = np.array([body.foot_length, body.foot_width, body.foot_thickness]) / 2
    if contact.foot == "box":
        foot.add_geom(name=f"foot_{side}", type=mujoco.mjtGeom.mjGEOM_BOX, size=half,
                      pos=(0, 0, half[2] - body.ankle_height), **bits)  # fmt: skip
    else:
        radius = half[2]
        for k, (x, y) in enumerate(((1, 1), (1, -1), (-1, 1), (-1, -1))):
            place = (x * (half[0] - radius), y * (half[1] - radius), radius - body.ankle_height)
            foot.add_geom(
                name=f"foot_{side}_{k}", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(radius, 0, 0), pos=place, **bits
            )
        _skin(foot, tuple(half), (0, 0, half[2] - body.ankle_height), DARK)
    foot.add_site(name=f"sole_{side}", pos=(0, 0, -body.ankle_height))


def _joint(spec, link, name: str, axis, limits: np.ndarray, config: RobotModelConfig) -> None:
    servo = config.servo
    link.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis, range=limits, limited=True,
                   armature=servo.armature, damping=servo.damping)  # fmt: skip
    actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    actuator.set_to_position(kp=servo.kp, kv=servo.kv)
    actuator.forcelimited, actuator.forcerange = True, (-servo.torque, servo.torque)
