"""A study as written in a sweep script: arenas, strategies, and one kind of mission."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pydantic

from jaxbiped.api.registration import family_name, named, register
from jaxbiped.arenas.config import PopulationConfig
from jaxbiped.arenas.source import Family
from jaxbiped.config import input_error
from jaxbiped.core.names import METRICS
from jaxbiped.errors import InputError
from jaxbiped.executors.execution import Executor
from jaxbiped.mission.metric import Metric
from jaxbiped.mission.params import MissionConfig
from jaxbiped.mission.sensors import Sensor
from jaxbiped.mission.strategies import STRATEGIES, Strategy
from jaxbiped.planning.planners import Planner
from jaxbiped.statistics.schema import FAMILIES
from jaxbiped.statistics.schema import STRATEGIES as BUILT_IN
from jaxbiped.study.batching import check_numbers, strategies_of
from jaxbiped.study.components import fingerprinted
from jaxbiped.study.config import StudyConfig
from jaxbiped.study.sweep import SweepConfig


@dataclass(frozen=True)
class RandomArenas:
    """Arenas drawn from families that take turns; arena k of a seed is always the same.

    Args:
      families: names of families, scene files (.toml), generators of your own (functions of a random key that return
        an `Arena`, in JAX), or `Family` objects.
      count: number of arenas.
      population: measures that are fixed for built-in families.
    """

    families: Sequence[str | Path | Family | Any] = FAMILIES
    count: int = 600
    population: PopulationConfig = field(default_factory=PopulationConfig)


def Scenes(files: str | Path | Sequence[str | Path], count: int | None = None) -> RandomArenas:
    """Scenes that take turns.

    Args:
      files: a folder, or scene files.
      count: number of arenas; if larger than the number of scenes, scenes repeat with other noise. By default one each.

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
      strategies: names, `Strategy` objects, planners (allowed to cross everything, under the name of their class), or
        functions of NumPy arrays (see `HostPlanner`, under their own name).
      mission: robot, sensor, executor, costs and so on, the same for all strategies.
      seed: of the arenas and of all noise.
      metrics: additional columns: names, or metrics of your own, under the name of their class.
      sensor, executor: replace the mission's: names, or objects of your own, under the name of their class. Fields that
        depend on them and are not given are filled in: `robot.radius` is 0.125 m for all executors but `kinematic`.

      numbers: numbers of components, instead of their defaults: `{"sensor.reach": 0.5}`.

    Raises:
      InputError: an unknown name, two strategies with one name, a number out of its range.
    """

    arenas: RandomArenas = field(default_factory=RandomArenas)
    strategies: Sequence[str | Strategy | Planner | Any] = BUILT_IN
    mission: MissionConfig = field(default_factory=MissionConfig)
    seed: int = 0
    metrics: Sequence[str | Metric] = METRICS
    sensor: str | Sensor | None = None
    executor: str | Executor | None = None
    numbers: Mapping[str, float] = field(default_factory=dict)
    shard: int = 1024  # arenas that are computed and stored together
    own: tuple[Strategy, ...] = field(init=False, repr=False)

    def __post_init__(self):
        if isinstance(self.strategies, str | Strategy | Planner):
            raise InputError("must be a list", field="strategies", value=self.strategies)
        if isinstance(self.metrics, str | Metric | type):
            raise InputError("must be a list", field="metrics", value=self.metrics)
        object.__setattr__(self, "own", tuple(named(item) for item in self.strategies if not isinstance(item, str)))
        config = self.config()
        check_numbers(config.numbers, config.mission, strategies_of(config))

    def config(self, axes: Mapping[str, Sequence[float | int]] | None = None) -> StudyConfig:
        """The config that a command line would produce; its strategies are registered.

        Args:
          axes: axes of a sweep: dotted fields, each with its values; every combination is a point.
        """
        for item in self.own:
            STRATEGIES.add(item.name, item, replace=item.name not in BUILT_IN)
        data = {
            "seed": self.seed,
            "arenas": self.arenas.count,
            "families": tuple(map(family_name, self.arenas.families)),
            "strategies": tuple(item if isinstance(item, str) else named(item).name for item in self.strategies),
            "metrics": tuple(item if isinstance(item, str) else metric_name(item) for item in self.metrics),
            "numbers": dict(self.numbers),
            "population": self.arenas.population.model_dump(),
            "mission": self._mission(),
            "shard": self.shard,
        }
        if axes is not None:
            data["axes"] = [{"field": name, "values": numbers_of_axis(name, values)} for name, values in axes.items()]
        try:
            config = (StudyConfig if axes is None else SweepConfig).model_validate(data)
        except pydantic.ValidationError as error:
            raise input_error(error) from None
        return fingerprinted(config)

    def _mission(self) -> dict[str, Any]:
        """The mission's config; with another sensor or executor, fields that depend on these are filled in again."""
        own = self._seen_and_moved()
        return self.mission.model_dump(exclude_unset=True) | own if own else self.mission.model_dump()

    def _seen_and_moved(self) -> dict[str, str]:
        """Names of the sensor and the executor, if they are not the mission's."""
        own = {"sensor": self.sensor, "executor": self.executor}
        return {
            kind: item if isinstance(item, str) else register(item, replace=True) for kind, item in own.items() if item
        }

    @classmethod
    def from_toml(cls, path: str | Path) -> Study:
        """The study of a TOML file, as `jaxbiped compare FILE` reads it."""
        from jaxbiped.config import load

        config = load(StudyConfig, path)
        arenas = RandomArenas(config.families, config.arenas, config.population)
        return cls(
            arenas=arenas,
            strategies=config.strategies,
            mission=config.mission,
            seed=config.seed,
            metrics=config.metrics,
            shard=config.shard,
            numbers=config.numbers,
        )


def metric_name(thing: Any) -> str:
    """The name of a metric or a class of metrics, which is registered; `InputError` for anything else."""
    if isinstance(thing, Metric) or (isinstance(thing, type) and issubclass(thing, Metric)):
        return register(thing, replace=True)
    raise InputError("must be a name, or a Metric or its class", field="metrics", value=thing)


def numbers_of_axis(name: str, values: Any) -> tuple[float, ...]:
    """The values of an axis; `InputError` unless they are a list of numbers."""
    try:
        return tuple(map(float, values))
    except (TypeError, ValueError):
        raise InputError("must be a list of numbers", field=f"axes.{name}", value=values) from None
