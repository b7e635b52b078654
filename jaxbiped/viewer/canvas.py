"""The scene of the page: the arrays of a mission drawn in viser."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import trimesh
import trimesh.transformations as tf
from jaxtyping import Float, UInt8

from jaxbiped.mission.log import MissionLog
from jaxbiped.report.pictures import PLAN, TRACK
from jaxbiped.viewer import layers
from jaxbiped.viewer.mission_file import Shown
from jaxbiped.viewer.puppet import Puppet
from jaxbiped.viewer.triangles import arc, rgb, solids
from jaxbiped.viewer.words import BELIEF

LAYERS = {
    "map": ("Class map", True),
    "plan": ("Plan", True),
    "track": ("Walked", True),
    "points": ("Points, last measured", True),
    "all_points": ("Points, all so far", False),
    "voxels": ("3D grid", False),
    "robot": ("Robot", True),
    "belief": ("Believed pose", True),
    "camera": ("Camera", True),
    "arena": ("True boxes", True),
}  # name: label, whether it is initially shown
HEAVY = ("points", "all_points", "voxels")  # sent only if they are shown
POINT_SIZE, SMALL_POINT, MANY = 0.006, 0.0035, 4000  # [m], [m] if there are many; number of points that counts as many
PAPER = 0.0004  # [m] height of unmeasured cells above the floor
FRUSTUM = 0.10  # [m] length of the drawn camera frustum
AROUND, SUN, SUN_FROM = 1.9, 1.8, (-1.0, -2.0, 4.0)  # intensities; [m]
FIELD_OF_VIEW = math.radians(36)  # vertical field of view of the page
VIEW = np.array([-0.52, -1.35, 1.2])  # viewpoint relative to the target, in arena widths
PANEL_BESIDE, PANEL_BELOW = 0.23, 0.55  # shift of the target, in arena widths, to make room for the panel
WIDE = 1.6  # width by height of a window for which `VIEW` is right


class Canvas:
    """The drawing of one mission."""

    def __init__(self, server: Any):
        self.server = server
        self.still: list[Any] = []
        self.boxes: list[Any] = []
        self.bodies: list[Any] = []
        self.moving: dict[str, Any] = {}  # by the names of layers
        self.light()

    def light(self) -> None:
        """Even light from all around, so that the map's colours match the legend, and a sun that casts shadows."""
        scene = self.server.scene
        scene.world_axes.visible = False
        scene.configure_environment_map(None)
        scene.configure_default_lights(False)
        scene.add_light_ambient("/light/around", intensity=AROUND)
        scene.add_light_directional("/light/sun", intensity=SUN, cast_shadow=True, position=SUN_FROM)

    def show(self, mission: Shown, puppet: Puppet) -> None:
        """Draw the static parts of a mission, and the robot; remove those of a previous one."""
        for handle in (*self.still, *self.boxes, *self.bodies, *self.moving.values()):
            handle.remove()
        self.still, self.boxes, self.bodies, self.moving = [], [], [], {}
        self.mission = mission
        for solid in solids(mission.log):
            box = solid.name.startswith("arena/box")
            handle = self.server.scene.add_mesh_simple(
                f"/{solid.name}", solid.vertices, solid.faces, color=solid.colour, flat_shading=True, side="double",
                opacity=solid.opacity if solid.opacity < 1 else None, cast_shadow=box,
            )  # fmt: skip
            (self.boxes if box else self.still).append(handle)
        width, depth = (float(side) for side in mission.log.size_xy)  # an image is white in any light
        paper = self.server.scene.add_image("/arena/paper", np.full((8, 8, 3), 255, np.uint8), width, depth,
                                            position=(width / 2, depth / 2, PAPER), cast_shadow=False)  # fmt: skip
        self.still.append(paper)
        self.robot(puppet)
        first = self.server.initial_camera
        first.fov, (first.position, first.look_at) = FIELD_OF_VIEW, viewpoint(mission.log, WIDE)

    def robot(self, puppet: Puppet) -> None:
        """The bodies, each a frame with its geoms; the camera; and the mark of the believed pose."""
        scene = self.server.scene
        for name, parts in zip(puppet.bodies, puppet.parts(), strict=True):
            self.bodies.append(scene.add_frame(f"/robot/{name}", show_axes=False))
            for part in parts:
                scene.add_mesh_simple(
                    f"/robot/{part.name}", part.vertices, part.faces, color=part.colour, flat_shading=True
                )
        camera = self.mission.config.camera
        down = 2 * math.atan(math.tan(math.radians(camera.field_of_view) / 2) * camera.height / camera.width)
        self.moving["camera"] = scene.add_camera_frustum(
            "/camera", down, camera.width / camera.height, scale=FRUSTUM, thickness=0.0015, color=(214, 160, 20)
        )
        vertices, faces = footprint()
        self.moving["belief"] = scene.add_mesh_simple(
            "/belief", vertices, faces, color=rgb(BELIEF), side="double", cast_shadow=False
        )

    def pose(self, puppet: Puppet, qpos: Float[np.ndarray, "19"], looks_down: bool, time: float) -> None:
        """Move the robot to its state, and moving boxes to their positions at a time [s]."""
        for outline, handle in zip(self.mission.log.outlines, self.boxes, strict=True):
            if outline.way:
                handle.position = (*outline.moved(time), 0.0)
        bodies, eye = puppet.poses(qpos)
        for k, handle in enumerate(self.bodies):
            handle.position, handle.wxyz = bodies.position[k], bodies.wxyz[k]
        config = self.mission.config.camera
        camera, pitch = self.moving["camera"], math.radians(config.look_pitch if looks_down else config.pitch)
        camera.position, camera.wxyz = eye.position[0], looking_down(eye.wxyz[0], pitch)

    def moment(self, t: int, on: dict[str, bool]) -> None:
        """Draw the robot's knowledge at moment `t`, for those layers that are on."""
        for name in LAYERS:
            self.draw_layer(name, t, on[name])
        if self.mission.log.pictures:
            self.moving["camera"].image = self.mission.log.pictures[t].left

    def draw_layer(self, name: str, t: int, on: bool) -> None:
        """Draw one layer as of moment `t`, or hide it."""
        scene, log = self.server.scene, self.mission.log
        if name in HEAVY and not on:
            if handle := self.moving.pop(name, None):
                handle.remove()
        elif name == "map":
            self.map(layers.tiles(log, t), on)
        elif name == "voxels":
            self.moving[name] = self.bricks(name, layers.voxels(log, t), on)
        elif name in ("points", "all_points"):
            cloud = layers.cloud(log, t, earlier=name == "all_points")
            self.moving[name] = scene.add_point_cloud(
                f"/{name}", cloud.xyz.astype(np.float32), cloud.colour, precision="float32", point_shape="circle",
                point_shading="flat", point_size=SMALL_POINT if len(cloud.xyz) > MANY else POINT_SIZE,
            )  # fmt: skip
        elif name == "plan":
            arrows = layers.plan_line(log, t)
            self.moving[name] = scene.add_arrows(
                f"/{name}", arrows, linear(np.tile(np.uint8(rgb(PLAN)), (len(arrows), 1))), shaft_radius=0.005,
                head_radius=0.013, head_length=0.022, visible=on,
            )  # fmt: skip
        elif name == "track":
            line = layers.track_line(log, t)
            self.moving[name] = scene.add_line_segments(f"/{name}", line, rgb(TRACK), thickness=0.008, visible=on)
        else:
            for handle in {"robot": self.bodies, "arena": self.boxes}.get(name) or [self.moving[name]]:
                handle.visible = on
            if name == "belief":
                x, y, z, yaw = layers.belief(log, t)
                mark = self.moving[name]
                mark.position, mark.wxyz = (x, y, z + 0.01), (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))

    def map(self, tiles: layers.Bricks, on: bool) -> None:
        """Draw the tiles; existing ones are moved and coloured, which avoids flicker."""
        handle = self.moving.get("map")
        if handle is None:
            self.moving["map"] = self.bricks("map", tiles, on)
        else:
            handle.batched_positions, handle.batched_colors = tiles.centre, linear(tiles.colour)
            handle.visible = on

    def bricks(self, name: str, bricks: layers.Bricks, on: bool) -> Any:
        """Many boxes of one size."""
        box = trimesh.creation.box(bricks.size)
        upright = np.tile([1.0, 0.0, 0.0, 0.0], (len(bricks.centre), 1))
        return self.server.scene.add_batched_meshes_simple(
            f"/{name}", box.vertices[box.faces].reshape(-1, 3), np.arange(36).reshape(-1, 3), upright, bricks.centre,
            batched_colors=linear(bricks.colour), flat_shading=True, lod="off", cast_shadow=False, visible=on,
        )  # fmt: skip


def viewpoint(log: MissionLog, aspect: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Viewpoint [m] and target from which the whole arena is visible beside the panel, or above it.

    Args:
      aspect: aspect ratio of the window, width by height.
    """
    width, depth = (float(side) for side in log.size_xy)
    size = max(width, depth)
    far = size * max(1.0, (WIDE if aspect > 1 else 0.92) / max(aspect, 0.2))
    towards = np.array([*VIEW[:2], 0.0]) / np.hypot(*VIEW[:2])  # direction of the viewer; perpendicular to their right
    right = np.array([-towards[1], towards[0], 0.0])
    aside = PANEL_BESIDE * size * right if aspect > 1 else PANEL_BELOW * far * towards
    middle = np.array([width / 2, depth / 2, 0.0]) + aside
    return tuple((middle + far * VIEW).tolist()), tuple(middle.tolist())


def footprint() -> tuple[Float[np.ndarray, "V 3"], np.ndarray]:
    """A ring about the origin with a nose along x: its vertices [m], and its faces, from above and from below."""
    ring = arc(0.085, 0.0, 2 * math.pi)
    nose = np.array([[0.115, 0.0, 0.0], [0.088, 0.018, 0.0], [0.088, -0.018, 0.0]])
    last = len(ring.vertices)
    return np.concatenate([ring.vertices, nose]), np.concatenate([ring.faces, last + np.array([[0, 1, 2], [0, 2, 1]])])


def looking_down(wxyz: Float[np.ndarray, "4"], pitch: float) -> Float[np.ndarray, "4"]:
    """The attitude of a camera (x right, y down, z ahead) that is pitched [rad] down on a frame (x ahead, z up)."""
    cos, sin = math.cos(pitch), math.sin(pitch)
    R = np.eye(4)
    R[:3, :3] = np.array([[0.0, -sin, cos], [-1.0, 0.0, 0.0], [0.0, -cos, -sin]])
    return tf.quaternion_multiply(wxyz, tf.quaternion_from_matrix(R))


def linear(colour: UInt8[np.ndarray, "n 3"]) -> UInt8[np.ndarray, "n 3"]:
    """Colours of a screen as shares of light, which is how viser takes those of many meshes at once."""
    share = colour / 255
    return np.round(255 * np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)).astype(np.uint8)
