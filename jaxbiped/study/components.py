"""The user's own components in a study, and a hash of each."""

from __future__ import annotations

from typing import TypeVar

from jaxbiped.arenas.source import find_family
from jaxbiped.core.code_hash import component_hash
from jaxbiped.core.names import BUILT_IN_METRICS, STRATEGIES
from jaxbiped.executors.execution import find_executor
from jaxbiped.mission.config import EXECUTORS, SENSORS
from jaxbiped.mission.metric import column_of, find_metric
from jaxbiped.mission.sensors import find_sensor
from jaxbiped.mission.strategies import Strategy, find_strategy
from jaxbiped.study.config import StudyConfig

FAMILY, METRIC, SENSOR, EXECUTOR = "family", "metric", "sensor", "executor"  # prefixes of their names

C = TypeVar("C", bound=StudyConfig)


def hash_of(strategy: Strategy) -> str:
    """A strategy's abilities, and twelve hex digits of its planner's code and numbers."""
    dares = f"{strategy.bumps:d}{strategy.gates:d}{strategy.blind:d}"
    return f"{dares}-{component_hash(strategy.planner) if strategy.planner is not None else 'none'}"


def fingerprinted(config: C) -> C:
    """The config with `components` filled in, so that its hash covers the code of user components.

    Raises:
      InputError: an unknown component, or one whose module or file cannot be used.
    """
    own = [find_strategy(name) for name in config.strategies if name not in STRATEGIES]
    made = {item.name: hash_of(item) for item in own}
    for name in config.families:
        family = find_family(name)
        if not isinstance(family, str):
            made[f"{FAMILY} {family.name}"] = family.digest()
    for name in config.metrics:
        if name not in BUILT_IN_METRICS:
            made[f"{METRIC} {column_of(name)}"] = component_hash(find_metric(name))
    for kind, name, built_in, find in (
        (SENSOR, config.mission.sensor, SENSORS, find_sensor),
        (EXECUTOR, config.mission.executor, EXECUTORS, find_executor),
    ):
        if name not in built_in:
            made[f"{kind} {name}"] = component_hash(find(name))
    return config if made == config.components else config.model_copy(update={"components": made})
