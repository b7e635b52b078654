"""A few missions of a stored study played again, one by one, to be looked at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import polars as pl

from jaxbiped.arenas.families import SIZE_X, SIZE_Y
from jaxbiped.arenas.population import PopulationConfig
from jaxbiped.config import parse
from jaxbiped.errors import InputError
from jaxbiped.mission.eyes import eyes_for
from jaxbiped.mission.queue import stack
from jaxbiped.mission.settings import SIMULATED, MissionConfig, program
from jaxbiped.mission.stepped import Mission, run_logged
from jaxbiped.study.comparison import paired
from jaxbiped.study.evaluate import draw
from jaxbiped.study.manifest import MANIFEST, Manifest
from jaxbiped.study.sweep import point_at


@dataclass(frozen=True)
class Example:
    """An arena where two sides differ."""

    arena: int
    family: str
    difficulty: float
    why: str


def examples(frame: pl.DataFrame, first: str, second: str, count: int) -> tuple[Example, ...]:
    """Up to `count` arenas where two sides differ most, the kinds of difference taking turns.

    Kinds: the greatest difference in time where both arrived, whichever was faster; only the first arrived, and only
    the second. In the last two, the arena where the other walked furthest in vain.

    Args:
      frame: rows of two names in `strategy`.
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
    values: dict[str, float]  # of the swept fields at that point, by their dotted names
    strategy: str


def play_again(
    manifest: Manifest, point: int, values: dict[str, float], strategy: str, arenas: Sequence[int]
) -> list[Mission]:
    """Missions of some arenas, as the study played them, with their logs. Other arguments: see `Origin`.

    Raises:
      InputError: a config that this version does not know, or a biped that cannot be simulated here.
    """
    config, families, population = mission_of(manifest, point, values)
    populations = None if population == PopulationConfig() else stack([population.traced()])
    batch, seeds = draw(jax.random.key(manifest.seed), jnp.asarray(arenas), families, populations)
    play, static = run_logged, program(config, (SIZE_X, SIZE_Y))
    if config.executor in SIMULATED:
        from jaxbiped.mission.walking import rehearse, walk_logged  # loads MuJoCo

        rehearse(config)
        play = partial(walk_logged, config=config.walk)
    settings, eyes = config.settings(strategy), eyes_for(config)
    each = [jax.tree.map(lambda leaf, k=k: leaf[k], batch) for k in range(len(arenas))]
    try:
        return [play(arena, settings, seed, static, eyes=eyes) for arena, seed in zip(each, seeds, strict=True)]
    finally:
        if eyes:
            eyes.close()


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
