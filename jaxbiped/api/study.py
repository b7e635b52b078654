"""A study as a sweep script states it: arenas, strategies, and one kind of mission."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pydantic

from jaxbiped.arenas.population import PopulationConfig
from jaxbiped.config import input_error
from jaxbiped.errors import InputError
from jaxbiped.mission.settings import MissionConfig
from jaxbiped.mission.strategies import STRATEGIES, Strategy, as_strategy
from jaxbiped.planning.planners import Planner
from jaxbiped.study.components import fingerprinted
from jaxbiped.study.config import StudyConfig
from jaxbiped.study.schema import FAMILIES
from jaxbiped.study.schema import STRATEGIES as BUILT_IN
from jaxbiped.study.sweep import SweepConfig


@dataclass(frozen=True)
class RandomArenas:
    """Arenas drawn from families; arena k of a seed is always the same one."""

    families: Sequence[str] = FAMILIES
    count: int = 600
    population: PopulationConfig = field(default_factory=PopulationConfig)


@dataclass(frozen=True)
class Study:
    """Strategies compared on the same arenas.

    Args:
      arenas: where missions take place.
      strategies: names, `Strategy` objects, planners (which dare all, under the name of their class), or functions
        of NumPy arrays (see `HostPlanner`, under their own name).
      mission: robot, sensor, executor, costs and so on, the same for all strategies.
      seed: of the arenas and of all noise.

    Raises:
      InputError: a name that is not known, two strategies of one name, a number out of its range.
    """

    arenas: RandomArenas = field(default_factory=RandomArenas)
    strategies: Sequence[str | Strategy | Planner | Any] = BUILT_IN
    mission: MissionConfig = field(default_factory=MissionConfig)
    seed: int = 0
    shard: int = 1024  # arenas that are computed, and stored, together
    own: tuple[Strategy, ...] = field(init=False, repr=False)

    def __post_init__(self):
        if isinstance(self.strategies, str | Strategy | Planner):
            raise InputError("must be a list", field="strategies", value=self.strategies)
        object.__setattr__(self, "own", tuple(named(item) for item in self.strategies if not isinstance(item, str)))
        self.config()

    def config(self, axes: Mapping[str, Sequence[float]] | None = None) -> StudyConfig:
        """The config that a command line would have; its strategies are registered.

        Args:
          axes: of a sweep: dotted fields, each with its values; every combination is a point.
        """
        for item in self.own:
            STRATEGIES.add(item.name, item, replace=item.name not in BUILT_IN)
        data = {
            "seed": self.seed,
            "arenas": self.arenas.count,
            "families": tuple(self.arenas.families),
            "strategies": tuple(item if isinstance(item, str) else named(item).name for item in self.strategies),
            "population": self.arenas.population.model_dump(),
            "mission": self.mission.model_dump(),
            "shard": self.shard,
        }
        if axes is not None:
            data["axes"] = [{"field": name, "values": tuple(map(float, values))} for name, values in axes.items()]
        try:
            config = (StudyConfig if axes is None else SweepConfig).model_validate(data)
        except pydantic.ValidationError as error:
            raise input_error(error) from None
        return fingerprinted(config)

    @classmethod
    def from_toml(cls, path: str | Path) -> Study:
        """The study of a TOML file, as `jaxbiped compare FILE` reads it."""
        from jaxbiped.config import load

        config = load(StudyConfig, path)
        arenas = RandomArenas(config.families, config.arenas, config.population)
        return cls(arenas, config.strategies, config.mission, config.seed, config.shard)


def named(thing: Any) -> Strategy:
    """A strategy of something that stands for one, under its own name."""
    if isinstance(thing, Strategy):
        return thing
    own = getattr(thing, "function", None) or thing
    name = getattr(own, "__name__", None) or type(own).__name__
    return as_strategy(thing, name)
