"""The page: what the rest of this folder gives as arrays, drawn by viser, and its controls."""

from __future__ import annotations

import contextlib
import io
import math
import socket
import threading
import time as clock
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from jaxbiped.errors import InputError
from jaxbiped.mission.log import MissionLog
from jaxbiped.report.animation import disparity_image
from jaxbiped.report.pictures import PLAN, TRACK
from jaxbiped.report.viewer import layers
from jaxbiped.report.viewer.motion import motion
from jaxbiped.report.viewer.puppet import Puppet
from jaxbiped.report.viewer.shown import Shown
from jaxbiped.report.viewer.solids import arc, rgb, solids
from jaxbiped.report.viewer.words import BELIEF, legend, status

LAYERS = {
    "map": ("Class map", True),
    "plan": ("Plan", True),
    "track": ("Walked", True),
    "points": ("Points of this measurement", True),
    "all_points": ("Points of all measurements", False),
    "voxels": ("3D grid", False),
    "robot": ("Robot", True),
    "belief": ("Where it believes to be", True),
    "camera": ("Camera's view", True),
    "arena": ("True boxes", True),
}  # name: label, whether it is shown at first
FRAMES_PER_SECOND = 15.0
SPEEDS = {"1 x": 1.0, "5 x": 5.0, "20 x": 20.0, "60 x": 60.0}
SPEED = "20 x"
POINT_SIZE = 0.004  # [m]
FRUSTUM = 0.10  # [m] drawn of the camera's view
FIELD_OF_VIEW = math.radians(40)  # down, of who looks at the page
VIEW = (-0.15, -1.15, 0.95)  # of the arena's width, from its middle: where one looks from
PANEL = 0.12  # of the arena's width that it is seen further left
AROUND, SUN, SUN_FROM = 2.2, 1.4, (-1.0, -2.0, 4.0)  # intensities; [m]


@dataclass
class Drawn:
    """Handles of what is on the page for one mission."""

    still: list[Any] = field(default_factory=list)
    boxes: list[Any] = field(default_factory=list)
    bodies: list[Any] = field(default_factory=list)
    moving: dict[str, Any] = field(default_factory=dict)  # by the names of layers


class Page:
    """One mission at a time, the same for all who look at it."""

    def __init__(self, server: Any, mission: Shown):
        self.server, self.lock = server, threading.RLock()
        self.playing, self.closed = False, False
        self.drawn, self.moment, self.time = Drawn(), -1, 0.0
        self.puppet: Puppet | None = None
        server.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(38, 92, 168))
        server.scene.world_axes.visible = False
        self.light()
        self.lay_out()
        self.show(mission)
        server.on_client_connect(self.greet)
        threading.Thread(target=self.play, daemon=True).start()

    def light(self) -> None:
        """Even light from all around, so that the map's colours are the legend's, and a sun that casts shadows."""
        scene = self.server.scene
        scene.configure_environment_map(None)
        scene.configure_default_lights(False)
        scene.add_light_ambient("/light/around", intensity=AROUND)
        scene.add_light_directional("/light/sun", intensity=SUN, cast_shadow=True, position=SUN_FROM)

    # The panel

    def lay_out(self) -> None:
        """The controls."""
        gui = self.server.gui
        self.heading = gui.add_markdown("")
        self.said = gui.add_markdown("")
        self.slider = gui.add_slider("Time [s]", 0, 1, 1, 0)
        self.button = gui.add_button("Play")
        self.steps = gui.add_button_group("Measurement", ("previous", "next"))
        self.speed = gui.add_dropdown("Speed", tuple(SPEEDS), initial_value=SPEED)
        self.left = self.disparity = None
        with gui.add_folder("Camera", visible=False) as self.pictures:
            blank = np.full((3, 4, 3), 255, np.uint8)
            self.left = gui.add_image(blank, label="left image")
            self.disparity = gui.add_image(blank, label="disparity: red is near, white not measured")
        with gui.add_folder("Layers"):
            self.boxes = {name: gui.add_checkbox(label, on) for name, (label, on) in LAYERS.items()}
        with gui.add_folder("Colours"):
            gui.add_html(legend())
        self.slider.on_update(lambda event: self.seek(float(self.slider.value)) if event.client else None)
        self.button.on_click(lambda _: self.toggle())
        self.steps.on_click(lambda _: self.step(1 if self.steps.value == "next" else -1))
        for name, box in self.boxes.items():
            box.on_update(lambda _, name=name: self.switch(name))

    def greet(self, client: Any) -> None:
        """Turn who comes to the arena; narrow windows need more distance."""
        with contextlib.suppress(Exception):  # who has left again
            client.camera.fov = FIELD_OF_VIEW
            client.camera.position, client.camera.look_at = self.viewpoint(client.camera.aspect)

    def viewpoint(self, aspect: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Where to look from, and at what."""
        width, depth = (float(side) for side in self.mission.log.size_xy)
        far = max(width, depth) * max(1.0, 1.25 / max(aspect, 0.2))
        shift = PANEL * far if aspect > 1 else 0.0  # the panel covers the right of wide windows
        middle = (width / 2 + shift, depth / 2, 0.0)
        return tuple(value + far * share for value, share in zip(middle, VIEW, strict=True)), middle

    # The mission

    def show(self, mission: Shown) -> None:
        """Draw another mission, from its start."""
        with self.lock, self.server.atomic():
            self.playing = False
            for handle in (*self.drawn.still, *self.drawn.boxes, *self.drawn.bodies, *self.drawn.moving.values()):
                handle.remove()
            self.mission, self.drawn = mission, Drawn()
            if self.puppet is None or self.puppet.robot != mission.config.walk.biped:
                self.puppet = Puppet(mission.config.walk.biped)
            self.motion = motion(mission.log, self.puppet, mission.config.durations.measure)
            self.draw_arena(mission.log)
            self.draw_robot()
            self.heading.content = f"### {mission.title}\n{mission.ending}\n\n{mission.note}"
            log = mission.log
            self.slider.min, self.slider.max = 0, math.ceil(log.time[-1])
            self.pictures.visible = bool(log.pictures)
            self.nearest = max((float(np.quantile(p.disparity, 0.995)) for p in log.pictures), default=1.0) or 1.0
            camera = self.server.initial_camera
            camera.fov, (camera.position, camera.look_at) = FIELD_OF_VIEW, self.viewpoint(1.25)
            self.moment = -1
            self.seek(float(log.time[0]))

    def draw_arena(self, log: MissionLog) -> None:
        """What does not move."""
        scene = self.server.scene
        for solid in solids(log):
            handle = scene.add_mesh_simple(
                f"/{solid.name}", solid.vertices, solid.faces, color=solid.colour, flat_shading=True, side="double",
                opacity=solid.opacity if solid.opacity < 1 else None, cast_shadow=solid.name.startswith("arena/box"),
            )  # fmt: skip
            (self.drawn.boxes if solid.name.startswith("arena/box") else self.drawn.still).append(handle)

    def draw_robot(self) -> None:
        """The robot's bodies, each a frame with its geoms; its camera; and where it believes to stand."""
        scene, drawn = self.server.scene, self.drawn
        for name, parts in zip(self.puppet.bodies, self.puppet.parts(), strict=True):
            drawn.bodies.append(scene.add_frame(f"/robot/{name}", show_axes=False))
            for part in parts:
                scene.add_mesh_simple(
                    f"/robot/{part.name}", part.vertices, part.faces, color=part.colour, flat_shading=True
                )
        camera = self.mission.config.camera
        down = 2 * math.atan(math.tan(math.radians(camera.field_of_view) / 2) * camera.height / camera.width)
        drawn.moving["camera"] = scene.add_camera_frustum(
            "/camera", down, camera.width / camera.height, scale=FRUSTUM, thickness=0.0015, color=(214, 160, 20)
        )
        ring = arc(0.085, 0.0, 2 * math.pi)
        nose = np.array([[0.115, 0.0, 0.0], [0.088, 0.018, 0.0], [0.088, -0.018, 0.0]])
        vertices = np.concatenate([ring.vertices, nose])
        faces = np.concatenate([ring.faces, len(ring.vertices) + np.array([[0, 1, 2], [0, 2, 1]])])
        drawn.moving["belief"] = scene.add_mesh_simple("/belief", vertices, faces, color=rgb(BELIEF), side="double",
                                                       cast_shadow=False)  # fmt: skip

    def switch(self, name: str) -> None:
        """Show or hide a layer."""
        on = bool(self.boxes[name].value)
        with self.lock:
            handles = {"robot": self.drawn.bodies, "arena": self.drawn.boxes}.get(name, [self.drawn.moving.get(name)])
            if name in ("points", "all_points", "voxels") and on:
                self.draw_moment(self.moment)  # they are sent only where they are seen
            else:
                for handle in filter(None, handles):
                    handle.visible = on

    # Time

    def toggle(self) -> None:
        """Play, or pause; from the start again when it is over."""
        with self.lock:
            if not self.playing and self.time >= self.mission.log.time[-1]:
                self.seek(float(self.mission.log.time[0]))
            self.playing = not self.playing
            self.button.label = "Pause" if self.playing else "Play"

    def step(self, ahead: int) -> None:
        """To the next moment, or to the one before."""
        last = len(self.mission.log.time) - 1
        self.seek(float(self.mission.log.time[int(np.clip(self.moment + ahead, 0, last))]))

    def play(self) -> None:
        """Move on while playing; runs in a thread of its own."""
        before = clock.monotonic()
        while not self.closed:
            clock.sleep(1 / FRAMES_PER_SECOND)
            now = clock.monotonic()
            if self.playing:
                self.seek(self.time + (now - before) * SPEEDS[self.speed.value])
            before = now

    def seek(self, time: float) -> None:
        """Show the mission as it was at a time [s]."""
        with self.lock, self.server.atomic():
            log = self.mission.log
            self.time = min(max(time, 0.0), float(log.time[-1]))
            if self.playing and self.time >= log.time[-1]:
                self.playing, self.button.label = False, "Play"
            if self.slider.value != round(self.time):
                self.slider.value = min(round(self.time), int(self.slider.max))
            t = layers.moment_at(log, self.time)
            if t != self.moment:
                self.moment = t
                self.draw_moment(t)
            self.pose(t)
            self.said.content = status(log, t, self.time)

    def pose(self, t: int) -> None:
        """Put the robot where it is now."""
        bodies, eye = self.puppet.poses(self.motion.at(self.time))
        shown = self.boxes["robot"].value
        for k, handle in enumerate(self.drawn.bodies):
            handle.position, handle.wxyz, handle.visible = bodies.position[k], bodies.wxyz[k], shown
        camera, config = self.drawn.moving["camera"], self.mission.config.camera
        pitch = math.radians(config.look_pitch if self.mission.log.action[t] == "Look-down" else config.pitch)
        camera.position, camera.wxyz = eye.position[0], looking_down(eye.wxyz[0], pitch)

    def draw_moment(self, t: int) -> None:
        """Draw what the robot knew at moment `t`."""
        scene, log, on = self.server.scene, self.mission.log, {name: b.value for name, b in self.boxes.items()}
        moving = self.drawn.moving
        moving["map"] = self.bricks("/map", layers.tiles(log, t), on["map"])
        empty = layers.Bricks((1, 1, 1), np.zeros((0, 3)), np.zeros((0, 3), np.uint8))
        moving["voxels"] = self.bricks("/voxels", layers.voxels(log, t) if on["voxels"] else empty, on["voxels"])
        for name, earlier in (("points", False), ("all_points", True)):
            cloud = layers.cloud(log, t, earlier) if on[name] else layers.Cloud(empty.centre, empty.colour)
            moving[name] = scene.add_point_cloud(
                f"/{name}", cloud.xyz.astype(np.float32), cloud.colour, point_size=POINT_SIZE, point_shape="circle",
                point_shading="flat", precision="float32", visible=on[name],
            )  # fmt: skip
        moving["plan"] = scene.add_arrows(
            "/plan", layers.plan_line(log, t), rgb(PLAN), shaft_radius=0.004, head_radius=0.011, head_length=0.02,
            visible=on["plan"],
        )  # fmt: skip
        moving["track"] = scene.add_line_segments(
            "/track", layers.track_line(log, t), rgb(TRACK), thickness=0.007, visible=on["track"]
        )
        x, y, z, yaw = layers.belief(log, t)
        mark = moving["belief"]
        mark.position, mark.wxyz = (x, y, z + 0.01), (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
        mark.visible, moving["camera"].visible = on["belief"], on["camera"]
        if log.pictures:
            self.left.image = moving["camera"].image = log.pictures[t].left
            self.disparity.image = disparity_image(log.pictures[t], self.nearest)

    def bricks(self, name: str, bricks: layers.Bricks, visible: bool) -> Any:
        """Many boxes at once."""
        import trimesh

        box = trimesh.creation.box(bricks.size)
        turned = np.tile([1.0, 0.0, 0.0, 0.0], (len(bricks.centre), 1))
        return self.server.scene.add_batched_meshes_simple(
            name, box.vertices[box.faces].reshape(-1, 3), np.arange(36).reshape(-1, 3), turned, bricks.centre,
            batched_colors=linear(bricks.colour), flat_shading=True, lod="off", cast_shadow=False, visible=visible,
        )  # fmt: skip

    def close(self) -> None:
        """Stop playing, and the server."""
        self.closed = True
        with quiet():
            self.server.stop()


def linear(colour: np.ndarray) -> np.ndarray:
    """Colours of a screen as shares of light, which is what viser takes for many meshes at once."""
    share = colour / 255
    return np.round(255 * np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)).astype(np.uint8)


def looking_down(wxyz: np.ndarray, pitch: float) -> np.ndarray:
    """The attitude of a camera (x right, y down, z ahead) on a level frame (x ahead, z up) that it pitches under."""
    import trimesh.transformations as tf

    cos, sin = math.cos(pitch), math.sin(pitch)
    R = np.eye(4)
    R[:3, :3] = np.array([[0.0, -sin, cos], [-1.0, 0.0, 0.0], [0.0, -cos, -sin]])
    return tf.quaternion_multiply(wxyz, tf.quaternion_from_matrix(R))


def serve(mission: Shown, host: str, port: int) -> Page:
    """Open the page on a port, and return it; it is served by threads of its own.

    Raises:
      InputError: viser is not installed, or the port is taken.
    """
    try:
        import viser
    except ImportError:
        raise InputError("needs viser: pip install 'jaxbiped[view]'", field="view") from None
    refuse_taken(host, port)
    with quiet():
        server = viser.ViserServer(host=host, port=port, label="jaxbiped", verbose=False)
    if port and server.get_port() != port:  # taken in between: viser goes on to the next one
        with quiet():
            server.stop()
        raise taken(port)
    return Page(server, mission)


def refuse_taken(host: str, port: int) -> None:
    """Raise `InputError` unless a port can be listened to."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except OSError as error:
        raise InputError(f"must be an address of this machine: {error.strerror}", field="host", value=host) from None
    with socket.socket(family, kind, protocol) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(address)
        except PermissionError:
            raise InputError("may not be listened to; choose one above 1023", field="port", value=port) from None
        except OSError as error:
            if error.errno == 99:
                raise InputError("must be an address of this machine", field="host", value=host) from None
            raise taken(port) from None


def taken(port: int) -> InputError:
    """The error of a port that something else listens to."""
    return InputError("is taken; choose another port, or 0 for any that is free", field="port", value=port)


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Without what viser prints."""
    with contextlib.redirect_stdout(io.StringIO()):
        yield
