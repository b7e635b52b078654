"""The simulated biped's MJCF as meshes, one per body, and their poses in a state."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
import trimesh
from jaxtyping import Float

from jaxbiped.biped.config import RobotModelConfig
from jaxbiped.biped.gait import home_table
from jaxbiped.biped.model import home_qpos, robot_spec
from jaxbiped.viewer.triangles import Solid, solid

EYE = "camera_left"  # site of the camera whose pictures are kept


@dataclass(frozen=True)
class Pose:
    """Positions and attitudes of some frames in the world."""

    position: Float[np.ndarray, "K 3"]  # [m]
    wxyz: Float[np.ndarray, "K 4"]  # unit quaternions


class Puppet:
    """A biped without dynamics that takes any posture."""

    def __init__(self, robot: RobotModelConfig):
        self.robot = robot
        self.model = robot_spec(robot).compile()
        self.data = mujoco.MjData(self.model)
        self.bodies = [self.model.body(b).name for b in range(1, self.model.nbody)]
        self.eye = self.model.site(EYE).id

    def parts(self) -> tuple[tuple[Solid, ...], ...]:
        """For each body its geoms, in the body's frame."""
        found: list[list[Solid]] = [[] for _ in self.bodies]
        for g in range(self.model.ngeom):
            mesh = shape(int(self.model.geom_type[g]), self.model.geom_size[g])
            T_body_geom = trimesh.transformations.quaternion_matrix(self.model.geom_quat[g])
            T_body_geom[:3, 3] = self.model.geom_pos[g]
            mesh.apply_transform(T_body_geom)
            colour = tuple(round(255 * float(channel)) for channel in self.model.geom_rgba[g, :3])
            body = int(self.model.geom_bodyid[g]) - 1
            found[body].append(solid(f"{self.bodies[body]}/{g}", mesh, colour))
        return tuple(tuple(parts) for parts in found)

    def poses(self, qpos: Float[np.ndarray, "19"]) -> tuple[Pose, Pose]:
        """Poses of the bodies in a state, and (a single one) of the left camera, level: x ahead, z up."""
        self.data.qpos[:] = qpos
        mujoco.mj_kinematics(self.model, self.data)
        wxyz = np.empty(4)
        mujoco.mju_mat2Quat(wxyz, self.data.site_xmat[self.eye])
        bodies = Pose(self.data.xpos[1:].copy(), self.data.xquat[1:].copy())
        return bodies, Pose(self.data.site_xpos[self.eye][None].copy(), wxyz[None])

    def home(self, x: float, y: float, z: float, yaw: float, squat: bool) -> Float[np.ndarray, "19"]:
        """The state of standing or squatting still, feet around (x, y, z) [m], rotated by `yaw` [rad]."""
        table = home_table(self.robot, bool(squat))
        return self.carried(table.pelvis[-1], table.q[-1], (x, y, z, yaw))

    def carried(
        self,
        pelvis: Float[np.ndarray, "3"],
        q: Float[np.ndarray, "12"],
        at: tuple[float, float, float, float],
        turned: float = 0.0,
    ) -> Float[np.ndarray, "19"]:
        """The state with hips at `pelvis` [m], joints `q` and the torso turned by `turned` [rad], all in a frame.

        Args:
          at: the frame's x, y, z [m] and yaw [rad].
        """
        x, y, z, yaw = at
        cos, sin = np.cos(yaw), np.sin(yaw)
        hips = np.array([x + cos * pelvis[0] - sin * pelvis[1], y + sin * pelvis[0] + cos * pelvis[1], z + pelvis[2]])
        return home_qpos(self.model, hips, q, yaw + turned)


def shape(kind: int, size: Float[np.ndarray, "3"]) -> trimesh.Trimesh:
    """A geom of MuJoCo about its own frame."""
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return trimesh.creation.box(2 * size)
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return trimesh.creation.capsule(2 * size[1], size[0], count=(24, 24))
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return trimesh.creation.icosphere(2, size[0])
    raise ValueError(f"the robot has no geoms of kind {mujoco.mjtGeom(kind).name}")
