"""Which sweep points share a compiled program, and the shards that a study is computed and written in."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Int

from jaxbiped.arenas.families import SIZE_X, SIZE_Y
from jaxbiped.arenas.population import Population, PopulationConfig
from jaxbiped.mission.eyes import RENDERED
from jaxbiped.mission.footwork import WalkConfig
from jaxbiped.mission.queue import stack
from jaxbiped.mission.settings import SIMULATED, MissionConfig, Program, Settings, program
from jaxbiped.mission.strategies import strategy
from jaxbiped.sensing.camera import CameraConfig
from jaxbiped.study.config import StudyConfig


@dataclass(frozen=True)
class Point:
    """One sweep point: a kind of mission, on one population of arenas."""

    index: int
    mission: MissionConfig
    population: PopulationConfig
    values: dict[str, float] = field(default_factory=dict)  # dotted field of the config: its value here


@dataclass(frozen=True)
class Group:
    """Sweep points that differ in traced numbers alone: `P` points, `S` strategies, one compiled program."""

    static: Program
    walk: WalkConfig | None  # of simulated bipeds
    camera: CameraConfig | None  # of sensors that measure on the host
    points: tuple[int, ...]  # indices of the points, rising
    settings: Settings  # [P * S], strategy by strategy within a point
    populations: Population | None  # [U], those that differ; None: nothing is fixed in any
    population_of: Int[np.ndarray, "PS"]  # row of `populations` of each row of `settings`


@dataclass(frozen=True)
class Shard:
    """A block of arenas under all points of a group: what one call computes, and one file holds."""

    number: int
    group: int
    first: int  # arena
    count: int


def only_point(config: StudyConfig) -> tuple[Point, ...]:
    """A study that sweeps nothing."""
    return (Point(0, config.mission, config.population),)


def group_points(points: Iterable[Point], strategies: Sequence[str]) -> tuple[Group, ...]:
    """Points by what sets array shapes and code paths (`mission.program`), in the order of their first.

    Raises:
      InputError: a point whose grid does not fit the area.
    """
    together: dict[tuple, list[Point]] = {}
    for point in points:
        simulated = point.mission.executor in SIMULATED
        walk = point.mission.walk if simulated else None
        camera = point.mission.camera if point.mission.sensor in RENDERED else None
        together.setdefault((program(point.mission, (SIZE_X, SIZE_Y)), walk, camera), []).append(point)
    return tuple(group(*key, members, strategies) for key, members in together.items())


def group(
    static: Program,
    walk: WalkConfig | None,
    camera: CameraConfig | None,
    points: Sequence[Point],
    strategies: Sequence[str],
) -> Group:
    """The points of one program."""
    settings = []
    for point in points:
        first = point.mission.settings(strategies[0])
        cutting = point.mission.corner_cutting
        settings += [replace(first, strategy=strategy(name, cutting)) for name in strategies]
    different = list(dict.fromkeys(point.population for point in points))
    drawn = different == [PopulationConfig()]
    return Group(
        static=static,
        walk=walk,
        camera=camera,
        points=tuple(point.index for point in points),
        settings=stack(settings),
        populations=None if drawn else stack([population.traced() for population in different]),
        population_of=np.repeat([different.index(point.population) for point in points], len(strategies)),
    )


def shards(config: StudyConfig, groups: int) -> tuple[Shard, ...]:
    """All shards of a study, numbered group by group; a function of the config alone."""
    size = min(config.shard, config.arenas)
    firsts = range(0, config.arenas, size)
    return tuple(
        Shard(group * len(firsts) + block, group, first, min(size, config.arenas - first))
        for group in range(groups)
        for block, first in enumerate(firsts)
    )
