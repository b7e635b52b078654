"""Sweep points in one compiled call: what is compiled, what is drawn, and whether each row is its own mission's."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import polars as pl
import pytest

from jaxbiped.arenas.config import PopulationConfig
from jaxbiped.arenas.families import FAMILIES
from jaxbiped.mission import batched_driver
from jaxbiped.mission.arena_batch import draw
from jaxbiped.mission.batched_driver import stack
from jaxbiped.statistics.schema import validate
from jaxbiped.study.config import StudyConfig
from jaxbiped.study.evaluation import evaluate
from jaxbiped.study.sweep import SweepConfig

EVENTS = []
jax.monitoring.register_event_duration_secs_listener(lambda event, *_, **__: EVENTS.append(event))

# What counts here is how often things compile, and the oracle's points compile fastest.
SMALL = {"arenas": 3, "shard": 2, "strategies": ("full", "floor_only"), "families": ("bump", "clutter")}
MISSION = {"sensor": "oracle", "limits": {"max_decisions": 4}}
BOX = {"points": 64, "seed": 1, "log_range": {f"costs.c{k}": (0.5, 50.0) for k in range(1, 5)}}
COSTS = SweepConfig(**SMALL, sobol=BOX, mission=MISSION)


def compiled():
    """Traces and compilations of this process so far."""
    return [event for event in EVENTS if event.startswith("/jax/core/compile/")]


@pytest.fixture(scope="module")
def swept():
    """64 cost vectors: their rows, programs compiled for their queue, and compilations after the first shard."""
    points, frames, after = list(COSTS.points()), [], []
    programs = len(batched_driver.COMPILED)
    for _, frame in evaluate(COSTS, points=points):
        frames.append(frame)
        after.append(len(compiled()))
    return pl.concat(frames), len(batched_driver.COMPILED) - programs, after[-1] - after[0]


def test_64_cost_vectors_compile_one_program(swept):
    rows, programs, later = swept
    assert programs == 1 and later == 0
    assert rows.height == 64 * 2 * 3 and len(validate(rows)) == rows.height


def test_each_row_is_that_of_its_point_alone(swept):
    """The same arenas at every point, and the missions of one point do not depend on the others'."""
    rows = swept[0]
    arenas = rows.group_by("arena").agg(pl.col("family", "difficulty").n_unique()).sort("arena")
    assert arenas.select("family", "difficulty").unique().row(0) == (1, 1)
    points = list(COSTS.points())
    some = [points[k] for k in (3, 60)] * 32  # as many as before: the program is compiled already
    before = len(compiled())
    (_, again), *_ = evaluate(COSTS, points=some)
    assert len(compiled()) == before
    first = again.head(2 * 2 * 2)
    expected = rows.filter(pl.col("point").is_in([3, 60]) & (pl.col("arena") < 2))
    key = ("point", "strategy", "arena")
    assert first.sort(key).equals(expected.sort(key))
    assert rows["oracle_cost"].n_unique() > 64  # the costs do count


@pytest.mark.slow  # a program for each batch
def test_every_column_of_every_row_is_the_same_in_any_batch():
    frames = {}
    for arenas, shard in ((48, 48), (16, 16), (5, 5), (1, 1), (48, 7)):
        config = StudyConfig(arenas=arenas, shard=shard)
        frames[arenas, shard] = pl.concat(frame for _, frame in evaluate(config)).sort("arena", "strategy")
    whole = frames[48, 48]
    for (arenas, shard), frame in frames.items():
        same = whole.filter(pl.col("arena") < arenas)
        assert [name for name in frame.columns if not frame[name].equals(same[name])] == [], (arenas, shard)


@pytest.mark.slow  # two more compilations of the whole loop
def test_two_pitches_compile_twice():
    axes = ({"field": "pitch", "values": (0.1, 0.05)}, {"field": "costs.c3", "values": (5, 10)})
    config = SweepConfig(**SMALL | {"arenas": 1}, axes=axes, mission=MISSION)
    programs = len(batched_driver.COMPILED)
    shards = [shard for shard, _ in evaluate(config, points=list(config.points()))]
    assert len(batched_driver.COMPILED) - programs == 2 and [shard.group for shard in shards] == [0, 1]


def test_populations_change_what_they_name_alone():
    drawn, seeds = jax.device_get(draw(jax.random.key(3), jnp.arange(24), FAMILIES))
    fixed = [PopulationConfig(), PopulationConfig(bump_width=0.2), PopulationConfig(bump_width=0.3, bump_length=0.9)]
    fixed.append(PopulationConfig(bump_height=0.045))
    all_of_them, same = jax.device_get(
        draw(jax.random.key(3), jnp.arange(24), FAMILIES, stack([population.traced() for population in fixed]))
    )
    np.testing.assert_array_equal(seeds, same)
    default, narrow, both, high = (
        jax.tree.map(lambda leaf, k=k: leaf[24 * k : 24 * k + 24], all_of_them) for k in range(len(fixed))
    )
    for ours, theirs in zip(jax.tree.leaves(default), jax.tree.leaves(drawn), strict=True):
        np.testing.assert_array_equal(ours, theirs)  # bit for bit what is drawn without a population
    bump = drawn.family == FAMILIES.index("bump")
    for arena in (narrow, both, high):
        for ours, theirs in zip(jax.tree.leaves(arena), jax.tree.leaves(drawn), strict=True):
            np.testing.assert_array_equal(ours[~bump], theirs[~bump])
        np.testing.assert_array_equal(arena.start_xyyaw, drawn.start_xyyaw)
    assert np.all(drawn.boxes.used[bump, 0])
    np.testing.assert_allclose(2 * narrow.boxes.half_x[bump, 0], 0.2, rtol=1e-6)
    np.testing.assert_allclose(narrow.boxes.half_y[bump, 0], drawn.boxes.half_y[bump, 0], rtol=0.05)
    np.testing.assert_allclose(2 * both.boxes.half_x[bump, 0], 0.3, rtol=1e-6)
    np.testing.assert_allclose(2 * both.boxes.half_y[bump, 0], 0.9, rtol=1e-6)
    np.testing.assert_allclose(high.boxes.top[bump, 0], 0.045, rtol=1e-6)
    high = replace(high, boxes=replace(high.boxes, top=drawn.boxes.top))
    for ours, theirs in zip(jax.tree.leaves(high), jax.tree.leaves(drawn), strict=True):
        np.testing.assert_array_equal(ours, theirs)
