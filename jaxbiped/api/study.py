"""A study as a sweep script states it: arenas, strategies, and one kind of mission."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pydantic

from jaxbiped.arenas.population import PopulationConfig
from jaxbiped.arenas.source import Family, as_family
from jaxbiped.config import input_error
from jaxbiped.core.registry import FAMILIES as FAMILIES_OWN
from jaxbiped.core.registry import METRICS as METRICS_OWN
from jaxbiped.errors import InputError
from jaxbiped.mission.metric import Metric, as_metric
from jaxbiped.mission.settings import MissionConfig
from jaxbiped.mission.strategies import STRATEGIES, Strategy, as_strategy
from jaxbiped.planning.planners import Planner
from jaxbiped.study.components import fingerprinted
from jaxbiped.study.config import StudyConfig
from jaxbiped.study.names import METRICS
from jaxbiped.study.schema import FAMILIES
from jaxbiped.study.schema import STRATEGIES as BUILT_IN
from jaxbiped.study.sweep import SweepConfig


@dataclass(frozen=True)
class RandomArenas:
    """Arenas drawn from families that take turns; arena k of a seed is always the same one.

    Args:
      families: names of families, scene files (.toml), generators of your own (functions of a random key that return
        an `Arena`, in JAX), or `Family` objects.
      count: of arenas.
      population: what is fixed of families that are built in.
    """

    families: Sequence[str | Path | Family | Any] = FAMILIES
    count: int = 600
    population: PopulationConfig = field(default_factory=PopulationConfig)


def Scenes(files: str | Path | Sequence[str | Path], count: int | None = None) -> RandomArenas:
    """Scenes that take turns.

    Args:
      files: a folder, or scene files.
      count: of arenas; more than there are scenes: each again, with other noise. By default one each.

    Raises:
      InputError: a folder without scenes.
    """
    if isinstance(files, str | Path):
        files = sorted(Path(files).glob("*.toml")) if Path(files).is_dir() else [files]
    if not files:
        raise InputError("holds no scenes (.toml)", field="scenes")
    return RandomArenas(tuple(str(file) for file in files), count or len(files))


@dataclass(frozen=True)
class Study:
    """Strategies compared on the same arenas.

    Args:
      arenas: where missions take place.
      strategies: names, `Strategy` objects, planners (which dare all, under the name of their class), or functions
        of NumPy arrays (see `HostPlanner`, under their own name).
      mission: robot, sensor, executor, costs and so on, the same for all strategies.
      seed: of the arenas and of all noise.
      metrics: columns beside those that all rows have: names, or metrics of your own, under the name of their class.

    Raises:
      InputError: a name that is not known, two strategies of one name, a number out of its range.
    """

    arenas: RandomArenas = field(default_factory=RandomArenas)
    strategies: Sequence[str | Strategy | Planner | Any] = BUILT_IN
    mission: MissionConfig = field(default_factory=MissionConfig)
    seed: int = 0
    metrics: Sequence[str | Metric] = METRICS
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
            "families": tuple(registered(item) for item in self.arenas.families),
            "strategies": tuple(item if isinstance(item, str) else named(item).name for item in self.strategies),
            "metrics": tuple(map(measured, self.metrics)),
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
        return cls(arenas, config.strategies, config.mission, config.seed, config.metrics, config.shard)


def registered(family: Any) -> str:
    """The name of a family in the registry."""
    if isinstance(family, str | Path):
        return str(family)
    made = family if isinstance(family, Family) else as_family(family, getattr(family, "__name__", str(family)))
    FAMILIES_OWN.add(made.name, made, replace=True)
    return made.name


def measured(metric: str | Metric) -> str:
    """The name of a metric in the registry: of one that is given as an object, its class's in small letters with _."""
    if isinstance(metric, str):
        return metric
    name = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", type(metric).__name__).lower()
    METRICS_OWN.add(name, as_metric(metric, name), replace=name not in METRICS)
    return name


def named(thing: Any) -> Strategy:
    """A strategy of something that stands for one, under its own name."""
    if isinstance(thing, Strategy):
        return thing
    own = getattr(thing, "function", None) or thing
    name = getattr(own, "__name__", None) or type(own).__name__
    return as_strategy(thing, name)
