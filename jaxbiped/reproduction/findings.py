"""All results for the page and its files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from jaxbiped.mission.log import MissionLog
from jaxbiped.mission.params import MissionConfig
from jaxbiped.reproduction.account import Measuring, Record
from jaxbiped.reproduction.mishaps import Ending
from jaxbiped.reproduction.savings import Population
from jaxbiped.reproduction.table_1 import Shown
from jaxbiped.reproduction.table_2 import Verified


@dataclass(frozen=True)
class Findings:
    """The results; parts that were skipped are empty."""

    config: MissionConfig  # of the missions in scenes
    experiments: Mapping[int, tuple[Record, ...]]  # by their numbers
    shown: Mapping[int, Record]  # the mission of each that tables and pictures show
    logs: Mapping[int, MissionLog]  # their logs
    shortest: Mapping[int, float | None]  # [m] length of the path by Eq. (1) with perfect knowledge of each scene
    gate_depth: float  # [m] depth of the lintel of experiment 6, along the path
    fit: Measuring | None
    table_1: Mapping[tuple[str, str], Shown] = field(default_factory=dict)  # (strategy, scene)
    table_2: tuple[Verified, ...] = ()
    endings: tuple[Ending, ...] = ()
    populations: tuple[Population, ...] = ()

    @property
    def default(self) -> float:
        """[s] Duration of a measurement on the missions' clocks."""
        return self.config.durations.measure

    @property
    def measure(self) -> float:
        """[s] Duration of a measurement: the fitted one, if it could be fitted."""
        return self.fit.seconds if self.fit else self.default
