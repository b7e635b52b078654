"""What a study is asked for: its arenas, its strategies, and one kind of mission."""

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

OF_COMPONENTS = ("planner.", "sensor.", "executor.")  # what the names of components' numbers begin with


def known_family(name: str) -> str:
    """A family that is built in or registered, a scene file, or `package.module:name`; nothing is read or imported."""
    if name.endswith(".toml"):
        return name
    return known_name(name, KNOWN, FAMILIES_OWN, "generator", "a scene file (.toml), ")


Family = Literal[KNOWN]
AnyFamily = Annotated[str, pydantic.AfterValidator(known_family)]


def known_strategy(name: str) -> str:
    """A name that is registered, or `package.module:name`, of which nothing is imported here."""
    return known_name(name, STRATEGIES, REGISTERED, "planner")


StrategyName = Annotated[str, pydantic.AfterValidator(known_strategy)]


def known_metric(name: str) -> str:
    """The same of a metric."""
    return known_name(name, BUILT_IN_METRICS, METRICS_OWN, "metric")


MetricName = Annotated[str, pydantic.AfterValidator(known_metric)]


class StudyConfig(Model):
    """Strategies compared on the same random arenas."""

    seed: Annotated[int, pydantic.Field(ge=0, lt=2**32)] = 0
    """Of arenas and noise. Arena k and its noise are functions of this seed and of k alone."""
    arenas: Annotated[int, pydantic.Field(ge=1, le=100_000_000)] = 600
    """How many."""
    families: Annotated[tuple[AnyFamily, ...], pydantic.Field(min_length=1)] = FAMILIES
    """Of arenas: obstacles, bump, stairs, gate, mixed, clutter (these by default), traffic, a scene (.toml), or
    package.module:name, a generator of your own. They take turns: arena k is of family k modulo their number. A
    scene file is a family with one arena."""
    strategies: Annotated[tuple[StrategyName, ...], pydantic.Field(min_length=1)] = STRATEGIES
    """Those that are compared, by default all below."""
    metrics: tuple[MetricName, ...] = METRICS
    """Columns beside those that all rows have: path efficiency (spl), the least distance from boxes (clearance), plans
    but the first (replans), the share of time spent measuring; energy, the work of the servos of simulated bipeds [J];
    or your own, as package.module:name."""
    numbers: dict[str, float] = pydantic.Field(default_factory=dict)
    """Of your own components, in place of their defaults: planner.clearance, sensor.reach or executor.slip, say."""
    components: Annotated[dict[str, str], tyro.conf.Fixed] = pydantic.Field(default_factory=dict)
    """A hash of the code and the numbers of each component that is not built in; filled in when the study begins."""
    shard: Annotated[int, pydantic.Field(ge=1, le=65536)] = 1024
    """Arenas that are computed, and written, together."""
    population: PopulationConfig = PopulationConfig()
    """What is the same in all arenas of a family, and not drawn."""
    mission: Annotated[MissionConfig, tyro.conf.arg(name="")] = MissionConfig()

    @pydantic.model_validator(mode="after")
    def _distinct(self):
        for name in ("families", "strategies", "metrics"):
            if len(set(getattr(self, name))) < len(getattr(self, name)):
                raise ValueError(f"{name} must be named once each")
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
