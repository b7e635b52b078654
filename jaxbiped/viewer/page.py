"""The page: one mission and its controls, the same for all viewers."""

from __future__ import annotations

import contextlib
import math
import threading
import time as clock
from typing import Any

import numpy as np

from jaxbiped.report.animation import disparity_image
from jaxbiped.viewer.canvas import FIELD_OF_VIEW, LAYERS, Canvas, viewpoint
from jaxbiped.viewer.layers import moment_at
from jaxbiped.viewer.mission_choice import Missions, Place
from jaxbiped.viewer.mission_file import Shown
from jaxbiped.viewer.mission_motion import arrivals, motion
from jaxbiped.viewer.picker import Picker
from jaxbiped.viewer.puppet import Puppet
from jaxbiped.viewer.words import legend, status

FRAMES_PER_SECOND = 15.0
SPEEDS = {"1 x": 1.0, "5 x": 5.0, "20 x": 20.0, "60 x": 60.0}
SPEED = "20 x"
BRAND = (38, 92, 168)
LOOKED_DOWN = "Look-down"  # the action after which the camera was tilted to the feet


class Page:
    """Draws a mission at a time, and advances while it plays. `server` is a `viser.ViserServer`."""

    def __init__(self, server: Any, mission: Shown, missions: Missions | None = None, at: Place | None = None):
        """
        Args:
          missions: the source of other missions.
          at: strategy, sweep point and arena of `mission` there.
        """
        self.server, self.lock = server, threading.RLock()
        self.playing, self.closed, self.moment, self.time = False, False, -1, 0.0
        self.puppet: Puppet | None = None
        server.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=BRAND)
        self.canvas = Canvas(server)
        self.lay_out(missions, at)
        self.show(mission)
        server.on_client_connect(self.greet)
        threading.Thread(target=self.play, daemon=True).start()

    def lay_out(self, missions: Missions | None, at: Place | None) -> None:
        """The controls."""
        gui = self.server.gui
        self.heading, self.said = gui.add_markdown(""), gui.add_markdown("")
        self.slider = gui.add_slider("Time [s]", 0, 1, 1, 0)
        self.button = gui.add_button("Play")
        self.steps = gui.add_button_group("Measurement", ("previous", "next"))
        self.speed = gui.add_dropdown("Speed", tuple(SPEEDS), initial_value=SPEED)
        self.picker = Picker(gui, missions, self.show, at) if missions else None
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
        """Turn a new client to the arena; a narrow window needs more distance than a wide one."""
        with contextlib.suppress(Exception):  # the client may have left again
            client.camera.fov = FIELD_OF_VIEW
            client.camera.position, client.camera.look_at = viewpoint(self.mission.log, client.camera.aspect)

    def show(self, mission: Shown) -> None:
        """Draw another mission, from its start."""
        log = mission.log
        with self.lock, self.server.atomic():
            self.pause()
            self.mission = mission
            if self.puppet is None or self.puppet.robot != mission.config.walk.biped:
                self.puppet = Puppet(mission.config.walk.biped)
            measure = mission.config.durations.measure
            self.motion, self.ends = motion(log, self.puppet, measure), np.append(arrivals(log, measure), log.time[-1])
            self.canvas.show(mission, self.puppet)
            self.heading.content = f"### {mission.title}\n{mission.ending}\n\n{mission.note}"
            self.slider.value, self.slider.max = 0, max(1, math.ceil(log.time[-1]))
            self.pictures.visible = bool(log.pictures)
            self.nearest = max((float(np.quantile(p.disparity, 0.995)) for p in log.pictures), default=1.0) or 1.0
            self.moment = -1
            self.seek(float(log.time[0]))

    def on(self) -> dict[str, bool]:
        """The layers that are shown."""
        return {name: bool(box.value) for name, box in self.boxes.items()}

    def switch(self, name: str) -> None:
        """Show or hide a layer, according to its checkbox."""
        with self.lock, self.server.atomic():
            self.canvas.draw_layer(name, self.moment, self.on()[name])

    def toggle(self) -> None:
        """Play, or pause; restart when it is over."""
        with self.lock:
            if self.playing:
                return self.pause()
            if self.time >= self.mission.log.time[-1]:
                self.seek(float(self.mission.log.time[0]))
            self.playing, self.button.label = True, "Pause"

    def pause(self) -> None:
        """Stop playing."""
        self.playing, self.button.label = False, "Play"

    def step(self, ahead: int) -> None:
        """Go to the next moment, or to the previous one."""
        times = self.mission.log.time
        self.seek(float(times[int(np.clip(self.moment + ahead, 0, len(times) - 1))]))

    def play(self) -> None:
        """Advance while playing; runs in its own thread."""
        before = clock.monotonic()
        while not self.closed:
            clock.sleep(1 / FRAMES_PER_SECOND)
            now = clock.monotonic()
            with self.lock:
                if self.playing:
                    self.seek(self.time + (now - before) * SPEEDS[self.speed.value])
            before = now

    def seek(self, time: float) -> None:
        """Show the mission at a time [s]."""
        with self.lock, self.server.atomic():
            log = self.mission.log
            self.time = min(max(time, 0.0), float(log.time[-1]))
            if self.playing and self.time >= log.time[-1]:
                self.pause()
            if self.slider.value != round(self.time):
                self.slider.value = round(self.time)
            t = moment_at(log, self.time)
            if t != self.moment:
                self.moment = t
                self.canvas.moment(t, self.on())
                if log.pictures:
                    self.left.image = log.pictures[t].left
                    self.disparity.image = disparity_image(log.pictures[t], self.nearest)
            self.canvas.pose(self.puppet, self.motion.at(self.time), log.action[t] == LOOKED_DOWN, self.time)
            said = status(log, t, self.time, float(self.ends[min(t, len(self.ends) - 1)]))
            if said != self.said.content:
                self.said.content = said

    def close(self) -> None:
        """Stop playing."""
        self.closed = True
