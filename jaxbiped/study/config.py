"""The request for a study: its arenas, its strategies, and one kind of mission."""

from __future__ import annotations

from typing import Annotated, Literal

import pydantic
import tyro

from jaxbiped.arenas.config import FAMILY_OF, PopulationConfig
from jaxbiped.config import Model
from jaxbiped.core.names import BUILT_IN_METRICS, FAMILIES, KNOWN, METRICS, MOVING, STRATEGIES
from jaxbiped.core.registry import FAMILIES as FAMILIES_OWN
from jaxbiped.core.registry import METRICS as METRICS_OWN
from jaxbiped.core.registry import STRATEGIES as REGISTERED
from jaxbiped.core.registry import known_name
from jaxbiped.mission.config import SIMULATED, MissionConfig

OF_COMPONENTS = ("planner.", "sensor.", "executor.")  # prefixes of the names of components' numbers


def known_family(name: str) -> str:
    """A built-in or registered family, a scene file, or `package.module:name`; nothing is read or imported."""
    if name.endswith(".toml"):
        return name
    return known_name(name, KNOWN, FAMILIES_OWN, "generator", "a scene file (.toml), ")


Family = Literal[KNOWN]
AnyFamily = Annotated[str, pydantic.AfterValidator(known_family)]


def known_strategy(name: str) -> str:
    """A registered name, or `package.module:name`, from which nothing is imported here."""
    return known_name(name, STRATEGIES, REGISTERED, "planner")


StrategyName = Annotated[str, pydantic.AfterValidator(known_strategy)]


def known_metric(name: str) -> str:
    """The same for a metric."""
    return known_name(name, BUILT_IN_METRICS, METRICS_OWN, "metric")


MetricName = Annotated[str, pydantic.AfterValidator(known_metric)]


class StudyConfig(Model):
    """Strategies compared on the same random arenas."""

    seed: Annotated[int, pydantic.Field(ge=0, lt=2**32)] = 0
    """Seed of arenas and noise. Arena k and its noise are functions of this seed and of k alone."""
    arenas: Annotated[int, pydantic.Field(ge=1, le=100_000_000)] = 600
    """Number of arenas."""
    families: Annotated[tuple[AnyFamily, ...], pydantic.Field(min_length=1)] = FAMILIES
    """Families of arenas: obstacles, bump, stairs, gate, mixed, clutter (the default), traffic, a scene (.toml), or
    package.module:name, a generator of your own. They take turns: arena k is of family k modulo their number. A scene
    file is a family with one arena."""
    strategies: Annotated[tuple[StrategyName, ...], pydantic.Field(min_length=1)] = STRATEGIES
    """Strategies to compare, by default all below."""
    metrics: tuple[MetricName, ...] = METRICS
    """Additional columns: path efficiency (spl), the smallest distance from boxes (clearance), plans after the first
    (replans), the share of time spent measuring; energy, the work done by the servos of simulated bipeds [J]; or your
    own, as package.module:name."""
    numbers: dict[str, float] = pydantic.Field(default_factory=dict)
    """Numbers of your own components, to replace their defaults: planner.clearance, sensor.reach, executor.slip,
    say."""
    components: Annotated[dict[str, str], tyro.conf.Fixed] = pydantic.Field(default_factory=dict)
    """A hash of the code and numbers of each component that is not built in; filled in when the study starts."""
    shard: Annotated[int, pydantic.Field(ge=1, le=65536)] = 1024
    """Number of arenas that are computed and written together."""
    population: PopulationConfig = PopulationConfig()
    """Measures that are the same in all arenas of a family, instead of drawn."""
    mission: Annotated[MissionConfig, tyro.conf.arg(name="")] = MissionConfig()

    @pydantic.model_validator(mode="after")
    def _distinct(self):
        for name in ("families", "strategies", "metrics"):
            if len(set(getattr(self, name))) < len(getattr(self, name)):
                raise ValueError(f"{name} must be distinct")
        for name in self.numbers:
            if not (name.startswith(OF_COMPONENTS) and name.partition(".")[2].isidentifier()):
                raise ValueError(f"numbers: {name} must be planner.<field>, sensor.<field> or executor.<field>")
        for name, family in FAMILY_OF.items():
            if getattr(self.population, name) is not None and family not in self.families:
                raise ValueError(f"population.{name} needs the family {family}")
        if MOVING & set(self.families) and (self.mission.executor in SIMULATED or self.mission.sensor == "stereo"):
            raise ValueError(
                "the family traffic moves: its executor is kinematic or sampled, its sensor raycast or oracle"
            )
        return self
