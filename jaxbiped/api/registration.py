"""Names for users' components: strategies and planners, families of arenas, sensors, executors and metrics."""

from __future__ import annotations

import re
from dataclasses import replace as replaced
from pathlib import Path
from typing import Any

from jaxbiped.arenas.source import Family, as_family
from jaxbiped.core.component import as_component
from jaxbiped.core.names import BUILT_IN_METRICS
from jaxbiped.core.names import STRATEGIES as BUILT_IN_STRATEGIES
from jaxbiped.core.registry import EXECUTORS, FAMILIES, METRICS, SENSORS, STRATEGIES, Registry
from jaxbiped.errors import InputError
from jaxbiped.executors.execution import Executor
from jaxbiped.mission.config import EXECUTORS as BUILT_IN_EXECUTORS
from jaxbiped.mission.config import SENSORS as BUILT_IN_SENSORS
from jaxbiped.mission.metric import Metric, as_metric, column_of
from jaxbiped.mission.sensors import Sensor
from jaxbiped.mission.strategies import Strategy, as_strategy

NAME = re.compile(r"[A-Za-z][\w.+-]{0,39}")  # of a sensor or an executor
KINDS = (
    (Metric, METRICS, BUILT_IN_METRICS),
    (Sensor, SENSORS, BUILT_IN_SENSORS),
    (Executor, EXECUTORS, BUILT_IN_EXECUTORS),
)


def register(thing: Any, name: str | None = None, *, replace: bool = False) -> str:
    """Register a component under a name that commands, studies and tables can use.

    Args:
      thing: a `Strategy`, a `Planner`, a planning function of NumPy arrays, a `Family`, a `Sensor`, an `Executor` or a
        `Metric`.
      name: by default its own, or that of its class: `slow_walk` of `SlowWalk` for sensors, executors and metrics.
      replace: whether it may replace a component that is not built in.

    Returns:
      The name.

    Raises:
      InputError: a name that is taken or invalid.
    """
    if isinstance(thing, Family):
        made = thing if name is None else replaced(thing, name=name)
        FAMILIES.add(made.name, made, replace=replace)
        return made.name
    for base, registry, built_in in KINDS:
        if isinstance(thing, base) or (isinstance(thing, type) and issubclass(thing, base)):
            return add(registry, base, built_in, thing, name or snake_case(thing), replace)
    strategy = named(thing) if name is None else replaced(named(thing), name=name)
    STRATEGIES.add(strategy.name, strategy, replace=replace and strategy.name not in BUILT_IN_STRATEGIES)
    return strategy.name


def add(registry: Registry, base: type, built_in: tuple[str, ...], thing: Any, name: str, replace: bool) -> str:
    """Add a component to its registry."""
    if not NAME.fullmatch(name):
        message = "must begin with a letter and have at most 40 letters, digits and . _ + -"
        raise InputError(message, field=f"name of a {registry.kind}", value=name)
    if name in built_in and name not in registry:  # one that runs on the host
        raise InputError("is taken by a built-in one", field="name", value=name)
    made = as_metric(thing, name) if base is Metric else as_component(thing, base, f"{registry.kind} {name}")
    registry.add(name, made, replace=replace and name not in built_in)
    return name


def snake_case(thing: Any) -> str:
    """`slow_walk` for an object of the class `SlowWalk`, or for the class."""
    kind = thing if isinstance(thing, type) else type(thing)
    return column_of(f":{kind.__name__}")


def family_name(family: Any) -> str:
    """The name of a family in the registry; a generator is registered under its own name."""
    if isinstance(family, str | Path):
        return str(family)
    own = family if isinstance(family, Family) else as_family(family, getattr(family, "__name__", "own"))
    return register(own, replace=True)


def named(thing: Any) -> Strategy:
    """The strategy of a planner, function or strategy, under its own name."""
    if isinstance(thing, Strategy):
        return thing
    own = getattr(thing, "function", None) or thing
    name = getattr(own, "__name__", None) or type(own).__name__
    return as_strategy(thing, name)
