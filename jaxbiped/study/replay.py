"""Replay a few missions of a stored study, one by one, for inspection."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import polars as pl

from jaxbiped.arenas.config import PopulationConfig
from jaxbiped.arenas.source import OwnFamily, find_family
from jaxbiped.config import parse
from jaxbiped.core.code_hash import component_hash
from jaxbiped.core.registry import EXECUTORS as EXECUTORS_OWN
from jaxbiped.core.registry import FAMILIES
from jaxbiped.core.registry import SENSORS as SENSORS_OWN
from jaxbiped.errors import InputError
from jaxbiped.mission.arena_batch import draw
from jaxbiped.mission.batched_driver import stack
from jaxbiped.mission.config import EXECUTORS, SENSORS
from jaxbiped.mission.params import MissionConfig
from jaxbiped.mission.recorded_driver import Mission
from jaxbiped.mission.strategies import Strategy, find_strategy
from jaxbiped.statistics.comparison import paired
from jaxbiped.statistics.schema import KNOWN
from jaxbiped.statistics.schema import STRATEGIES as BUILT_IN
from jaxbiped.study.arena_kinds import kinds_of
from jaxbiped.study.components import EXECUTOR, FAMILY, SENSOR, hash_of
from jaxbiped.study.config import OF_COMPONENTS
from jaxbiped.study.manifest import MANIFEST, Manifest
from jaxbiped.study.runner import check_mission, numbered, play_one, seeing
from jaxbiped.study.sweep import point_at


@dataclass(frozen=True)
class Example:
    """An arena where two sides differ."""

    arena: int
    family: str
    difficulty: float
    why: str


def examples(frame: pl.DataFrame, first: str, second: str, count: int) -> tuple[Example, ...]:
    """Up to `count` arenas where two sides differ most, with the kinds of difference taking turns.

    Kinds: the greatest difference in time where both arrived, whichever was faster; only the first arrived; only the
    second arrived. In the last two, the arena where the other walked farthest in vain.

    Args:
      frame: rows with two names in `strategy`.
    """
    sides = [frame.filter(pl.col("strategy") == name) for name in (first, second)]
    both, solved = paired(*sides)
    apart = solved.with_columns(gap=pl.col("time") - pl.col("time_second")).filter(pl.col("gap").abs() > 1e-4)
    apart = apart.sort(pl.col("gap").abs(), "arena", descending=[True, False])
    lists = [
        [
            (arena, f"{second if gap > 0 else first} is faster by {abs(gap) / 60:.1f} min")
            for arena, gap in zip(apart["arena"][:count], apart["gap"][:count], strict=True)
        ]
    ]
    for winner, loser, lost in ((first, second, sides[1]), (second, first, sides[0])):
        ahead = pl.col("success") & ~pl.col("success_second")
        if winner == second:
            ahead = ~pl.col("success") & pl.col("success_second")
        rows = lost.join(both.filter(ahead).select("arena"), on="arena", how="semi")
        rows = rows.sort("walked", "arena", descending=[True, False], nulls_last=True)[:count]
        codes = [code.replace("_", " ") for code in rows["code"]]
        said = [f"only {winner} arrives; {loser}: {code}" for code in codes]
        lists.append(list(zip(rows["arena"], said, strict=True)))
    turns = [found[k] for k in range(count) for found in lists if k < len(found)]
    arenas = {row["arena"]: row for row in frame.unique("arena").iter_rows(named=True)}
    return tuple(
        Example(arena, arenas[arena]["family"], arenas[arena]["difficulty"], why) for arena, why in turns[:count]
    )


class Origin(NamedTuple):
    """Where missions come from: a study, one of its sweep points, and a strategy."""

    manifest: Manifest
    point: int
    values: dict[str, float]  # values of the swept fields at that point, by dotted name
    strategy: str


def play_again(
    manifest: Manifest,
    point: int,
    values: dict[str, float],
    strategy: str,
    arenas: Sequence[int],
    own: Mapping[str, Strategy] | None = None,
) -> list[Mission]:
    """Replay missions of some arenas as the study played them, with their logs. Other arguments: see `Origin`.

    Args:
      own: strategies that are not built in, by name. A results folder never causes an import.

    Raises:
      InputError: a config that this version does not know, a biped that cannot be simulated here, or a strategy that
        is neither built in nor given, or differs from that of the study.
    """
    again = strategy_again(manifest, strategy, own or {})
    said = manifest.config.get("mission")  # used in its raw form: parsing it as a config would import what it names
    for kind, default, known in ((SENSOR, "raycast", SENSORS), (EXECUTOR, "kinematic", EXECUTORS)):
        same_component(manifest, kind, str(said.get(kind, default)) if isinstance(said, dict) else default, known)
    config, families, population = mission_of(manifest, point, values)
    numbers = manifest.config.get("numbers", {}) | {k: v for k, v in values.items() if k.startswith(OF_COMPONENTS)}
    populations = None if population == PopulationConfig() else stack([population.traced()])
    families = families_again(manifest, families)
    check_mission(config)
    params = numbered(config.params(again), again, numbers)
    key, played = jax.random.key(manifest.seed), {}
    with seeing(config) as rig:
        for kind in kinds_of(families):
            mine = np.array([k for k in arenas if k % kind.number in kind.places], int)
            if len(mine):
                batch, seeds = draw(key, jnp.asarray(mine), kind.families, populations, jnp.asarray(kind.turns(mine)))
                for row, k in enumerate(mine):
                    arena = jax.tree.map(lambda leaf, row=row: leaf[row], batch)
                    played[int(k)] = play_one(arena, config, params, seeds[row], rig=rig)
    return [played[int(k)] for k in arenas]


def strategy_again(manifest: Manifest, name: str, own: Mapping[str, Strategy]) -> Strategy:
    """A strategy of a study: a built-in one, or one that is given and has the hash stored by the study."""
    if name in BUILT_IN:
        return find_strategy(name)
    if name not in own:
        message = "is not built in: its missions can be replayed only by a program that supplies it"
        raise InputError(message, field="strategy", value=name)
    if hash_of(own[name]) != manifest.config.get("components", {}).get(name):
        raise InputError("has different code or numbers than in the study", field="strategy", value=name)
    return own[name]


def same_component(manifest: Manifest, kind: str, name: str, built_in: Sequence[str]) -> None:
    """Raise `InputError` unless a sensor or an executor is built in, or registered with the study's hash."""
    if name in built_in:
        return
    registry = SENSORS_OWN if kind == SENSOR else EXECUTORS_OWN
    if name not in registry:
        raise InputError("is not built in: only a program that registers it can replay it", field=kind, value=name)
    if component_hash(registry.held[name]) != manifest.config.get("components", {}).get(f"{kind} {name}"):
        raise InputError("has different code or numbers than in the study", field=kind, value=name)


def families_again(manifest: Manifest, names: Sequence[str]) -> tuple[str | OwnFamily, ...]:
    """The families of a study: built-in ones, and scenes and registered ones that have the stored hash."""
    found = []
    for name in names:
        if name not in KNOWN and not name.endswith(".toml") and name not in FAMILIES:
            message = "is not built in: its arenas can be redrawn only by a program that registers it"
            raise InputError(message, field="families", value=name)
        found.append(find_family(name))
        hashes = manifest.config.get("components", {})
        if not isinstance(found[-1], str) and found[-1].digest() != hashes.get(f"{FAMILY} {found[-1].name}"):
            raise InputError("has changed since the study", field="families", value=name)
    return tuple(found)


def mission_of(
    manifest: Manifest, point: int, values: dict[str, float]
) -> tuple[MissionConfig, tuple[str, ...], PopulationConfig]:
    """The missions of one sweep point, and the families and the population of their arenas."""
    config = manifest.config
    if not {"mission", "families"} <= config.keys():
        raise InputError("the manifest holds no config of missions", file=MANIFEST)
    mission = parse(MissionConfig, config["mission"], file=MANIFEST)
    population = parse(PopulationConfig, config.get("population", {}), file=MANIFEST)
    here = point_at(point, values, mission.model_dump(), population.model_dump())
    return here.mission, tuple(config["families"]), here.population
