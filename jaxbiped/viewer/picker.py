"""Controls that choose another mission of a results folder."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from jaxbiped.errors import InputError
from jaxbiped.viewer.mission_choice import Missions, Place
from jaxbiped.viewer.mission_file import Shown

ANY = "arena"  # label of the field for any number


class Picker:
    """Strategy and sweep point, if there are several, a list of missions worth seeing, and any arena by number."""

    def __init__(self, gui: Any, missions: Missions, show: Callable[[Shown], None], at: Place | None = None):
        """
        Args:
          gui: of a viser server.
          show: called with a mission that was chosen.
          at: strategy, sweep point and arena of the mission shown.
        """
        self.missions, self.show, self.busy = missions, show, threading.Lock()
        strategy, point, arena = at or (missions.strategies[0], 0, 0)
        self.choices = missions.choices(strategy, point)
        with gui.add_folder("Missions"):
            many = len(missions.strategies) > 1
            self.strategy = gui.add_dropdown("Strategy", missions.strategies, initial_value=strategy, visible=many)
            many = len(missions.points) > 1
            self.point = gui.add_dropdown("Point", missions.points, initial_value=missions.points[point], visible=many)
            self.list = gui.add_dropdown("Show", self.labels(), initial_value=self.label(arena))
            studied = missions.strategies != ("",)
            self.number = gui.add_number("Any arena", arena, min=0, step=1, visible=studied)
            self.button = gui.add_button("Play this arena again", visible=studied)
            self.said = gui.add_markdown("")
        self.strategy.on_update(lambda event: self.relist() if event.client else None)
        self.point.on_update(lambda event: self.relist() if event.client else None)
        self.list.on_update(lambda event: self.pick() if event.client else None)
        self.button.on_click(lambda _: self.open(int(self.number.value)))

    def labels(self) -> tuple[str, ...]:
        """The entries of the list; the first one stands for an arena chosen by number."""
        return (ANY, *(choice.label for choice in self.choices))

    def label(self, arena: int) -> str:
        """An arena's entry in the list."""
        return next((choice.label for choice in self.choices if choice.arena == arena), ANY)

    def relist(self) -> None:
        """List the missions of another strategy or point; the same arena is shown, for comparison."""
        self.choices = self.missions.choices(self.strategy.value, self.at_point())
        self.list.options = self.labels()
        self.open(int(self.number.value))

    def pick(self) -> None:
        """Open the mission chosen in the list."""
        for choice in self.choices:
            if choice.label == self.list.value:
                self.open(choice.arena)

    def at_point(self) -> int:
        """The chosen sweep point."""
        return self.missions.points.index(self.point.value)

    def open(self, arena: int) -> None:
        """Open a mission and show it; meanwhile say that it is being played, or why it cannot be."""
        if not self.busy.acquire(blocking=False):
            return
        try:
            self.said.content = "*playing it again; the first takes a minute to compile*" if self.button.visible else ""
            mission = self.missions.open(self.strategy.value, self.at_point(), arena)
            self.number.value, self.list.value = arena, self.label(arena)
            self.show(mission)
            self.said.content = ""
        except InputError as error:
            self.said.content = f"**{error}**"
        finally:
            self.busy.release()
