"""Sweep points that share a compiled program, and the shards in which a study is computed and written."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Int

from jaxbiped.arenas.config import PopulationConfig
from jaxbiped.arenas.population import Population
from jaxbiped.arenas.source import OwnFamily, find_family, name_of
from jaxbiped.core.component import kind_of, numbers_of, traced_component, with_numbers
from jaxbiped.core.names import MOVING
from jaxbiped.errors import InputError
from jaxbiped.executors.config import WalkConfig
from jaxbiped.executors.execution import find_executor
from jaxbiped.mission.batched_driver import stack
from jaxbiped.mission.metric import Metric, column_of, find_metric
from jaxbiped.mission.params import SIMULATED, MissionConfig, MissionParams, MissionSpec
from jaxbiped.mission.sensor_rig import RENDERED
from jaxbiped.mission.sensors import find_sensor
from jaxbiped.mission.strategies import Strategy, find_strategy
from jaxbiped.mission.terrain_check import checked_spec
from jaxbiped.sensing.config import CameraConfig
from jaxbiped.statistics.schema import SCHEMA
from jaxbiped.study.arena_kinds import ANY, ArenaKind, kinds_of
from jaxbiped.study.config import StudyConfig


@dataclass(frozen=True)
class Point:
    """One sweep point: a kind of mission, on one population of arenas."""

    index: int
    mission: MissionConfig
    population: PopulationConfig
    values: dict[str, float] = field(default_factory=dict)  # values of dotted fields of the config
    own: dict[str, float] = field(default_factory=dict)  # those of components, such as `planner.clearance`


class Common(NamedTuple):
    """What the points of a group have in common."""

    kind: ArenaKind
    spec: MissionSpec
    walk: WalkConfig | None  # for simulated bipeds
    camera: CameraConfig | None  # for sensors that measure on the host


@dataclass(frozen=True)
class Group:
    """Points and strategies that differ only in traced numbers: `P` points, `S` strategies, one compiled program."""

    kind: ArenaKind
    spec: MissionSpec
    walk: WalkConfig | None  # for simulated bipeds
    camera: CameraConfig | None  # for sensors that measure on the host
    points: tuple[int, ...]  # indices of the points, ascending
    strategies: tuple[str, ...]  # their names
    params: MissionParams  # [P * S], strategy by strategy within a point
    populations: Population | None  # [U], the distinct ones; None: no population fixes anything
    population_of: Int[np.ndarray, "PS"]  # row of `populations` of each row of `params`
    metrics: tuple[str, ...] = ()  # columns of their metrics

    def rows(self, shard: Shard) -> int:
        """Number of rows in a shard of this group."""
        return self.kind.count(shard.first, shard.count) * len(self.population_of)


@dataclass(frozen=True)
class Shard:
    """A block of a group's arenas under all its points: computed in one call and stored in one file."""

    number: int
    group: int
    first: int  # arena
    count: int


def only_point(config: StudyConfig) -> tuple[Point, ...]:
    """The point of a study that sweeps nothing."""
    return (Point(0, config.mission, config.population),)


def strategies_of(config: StudyConfig) -> tuple[Strategy, ...]:
    """The strategies of a study, in its order.

    Raises:
      InputError: an unknown name, a module that cannot be imported, two strategies with one name.
    """
    found = tuple(find_strategy(name) for name in config.strategies)
    for k, item in enumerate(found):
        if item.name in [other.name for other in found[:k]]:
            raise InputError("two of them have this name", field="strategies", value=item.name)
    return found


def families_of(config: StudyConfig) -> tuple[str | OwnFamily, ...]:
    """The families of a study, in their order.

    Raises:
      InputError: an unknown family, a bad scene, two with one name.
    """
    found = tuple(map(find_family, config.families))
    names = [name_of(item) for item in found]
    for name in names:
        if names.count(name) > 1:
            raise InputError("two of them have this name", field="families", value=name)
    moving = MOVING & set(names)
    if moving and not all(isinstance(item, str) for item in found):
        raise InputError("moves, and can only be combined with built-in families", field="families", value=min(moving))
    return found


def metrics_of(config: StudyConfig) -> dict[str, Metric]:
    """The metrics of a study by their columns, in its order.

    Raises:
      InputError: an unknown name, a module that cannot be imported, two metrics with one column, or a column that all
        rows have.
    """
    found: dict[str, Metric] = {}
    for name in config.metrics:
        column = column_of(name)
        if column in found or column in SCHEMA:
            raise InputError("is a column that rows have already", field="metrics", value=name)
        found[column] = find_metric(name)
    return found


def group_points(
    points: Iterable[Point],
    strategies: Sequence[Strategy | str],
    kinds: Sequence[ArenaKind] = (ANY,),
    metrics: Mapping[str, Metric] | None = None,
    numbers: Mapping[str, float] | None = None,
) -> tuple[Group, ...]:
    """Group points by what sets array shapes and code paths (`mission.mission_spec`), in order of first occurrence.

    Strategies whose planners are of different kinds get separate groups.

    Args:
      kinds: kinds of arenas.
      metrics: metrics by their columns.
      numbers: numbers of components by their dotted names, for points that have none of their own.

    Raises:
      InputError: a point whose grid does not fit an area, or whose sensor or executor does not support a terrain.
    """
    strategies = [find_strategy(item) if isinstance(item, str) else item for item in strategies]
    points = tuple(replace(point, own={**(numbers or {}), **point.own}) for point in points)
    for point in points:
        check_numbers(point.own, point.mission, strategies)
    together: dict[tuple, list[Point]] = {}
    for place, point in itertools.product(range(len(kinds)), points):
        simulated = point.mission.executor in SIMULATED
        walk = point.mission.walk if simulated else None
        camera = point.mission.camera if point.mission.sensor in RENDERED else None
        spec = checked_spec(point.mission, kinds[place].size_xy, kinds[place].terrain)
        together.setdefault((place, spec, walk, camera), []).append(point)
    by_planner: dict[tuple, list[Strategy]] = {}
    for item in strategies:
        by_planner.setdefault(kind_of(item.planner), []).append(item)
    return tuple(
        group(Common(kinds[place], *key), members, same, metrics or {})
        for (place, *key), members in together.items()
        for same in by_planner.values()
    )


def check_numbers(own: Iterable[str], mission: MissionConfig, strategies: Sequence[Strategy]) -> None:
    """Raise `InputError` about a number (`planner.clearance`) that no component of the missions has."""
    there = {
        "planner": sorted({name for item in strategies for name in numbers_of(item.planner)}),
        "sensor": list(numbers_of(find_sensor(mission.sensor))),
        "executor": list(numbers_of(find_executor(mission.executor))),
    }
    for dotted in own:
        kind, _, name = dotted.partition(".")
        if name not in there.get(kind, ()):
            known = f"has {', '.join(there[kind])}" if there.get(kind) else "has none"
            raise InputError(f"no {kind} of these missions has this number; {kind} {known}", field=dotted)


def numbers_under(kind: str, numbers: Mapping[str, float]) -> dict[str, float]:
    """The numbers of a kind of component, by their own names."""
    return {name.removeprefix(f"{kind}."): value for name, value in numbers.items() if name.startswith(f"{kind}.")}


def groups_of(config: StudyConfig, points: Sequence[Point] | None = None) -> tuple[Group, ...]:
    """The groups of a study, or of a sweep with these points.

    Raises:
      InputError: strategies, families or points that cannot be combined.
    """
    kinds = kinds_of(families_of(config))
    return group_points(points or only_point(config), strategies_of(config), kinds, metrics_of(config), config.numbers)


def group(
    common: Common,
    points: Sequence[Point],
    strategies: Sequence[Strategy],
    metrics: Mapping[str, Metric],
) -> Group:
    """The group of the points of one program."""
    params, measured = [], tuple(traced_component(metric) for metric in metrics.values())
    for point in points:
        first = point.mission.params(strategies[0])
        for name in ("sensor", "executor"):
            component = with_numbers(getattr(first, name), numbers_under(name, point.own))
            first = replace(first, **{name: traced_component(component)})
        cutting = point.mission.corner_cutting
        for item in strategies:
            own = with_numbers(item.planner, numbers_under("planner", point.own))
            planner = first.planner if own is None else traced_component(own)
            params.append(replace(first, strategy=item.flags(cutting), planner=planner, metrics=measured))
    different = list(dict.fromkeys(point.population for point in points))
    drawn = different == [PopulationConfig()]
    return Group(
        **common._asdict(),
        points=tuple(point.index for point in points),
        strategies=tuple(item.name for item in strategies),
        params=stack(params),
        populations=None if drawn else stack([population.traced() for population in different]),
        population_of=np.repeat([different.index(point.population) for point in points], len(strategies)),
        metrics=tuple(metrics),
    )


def shards(config: StudyConfig, groups: int, *, swept: bool = False) -> tuple[Shard, ...]:
    """All shards of a study; a function of the config alone.

    They are numbered block by block, so that a study that ends early has all strategies on its arenas. Those of a sweep
    are numbered group by group, so that a program is compiled when the previous one is no longer needed.
    """
    size = min(config.shard, config.arenas)
    firsts = range(0, config.arenas, size)
    pairs = [(group, first) for group in range(groups) for first in firsts]
    if not swept:
        pairs.sort(key=lambda pair: (pair[1], pair[0]))
    return tuple(
        Shard(number, group, first, min(size, config.arenas - first)) for number, (group, first) in enumerate(pairs)
    )
