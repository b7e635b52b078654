"""Families of several sizes in one study: whose turn it is, and what blocks hold."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxbiped as jb
from jaxbiped.arenas import families as built_in
from jaxbiped.arenas.source import Family, scene_family
from jaxbiped.mission.arena_batch import draw
from jaxbiped.statistics.schema import SCHEMA
from jaxbiped.study.arena_kinds import ANY, kinds_of
from jaxbiped.study.batching import group_points, only_point
from jaxbiped.study.config import StudyConfig
from tests.api.conftest import EXAMPLES

CONFIGS = EXAMPLES.parents[1] / "configs"


def wide(key):
    return replace(built_in.sample(key, 0), size_xy=jnp.array([3.0, 1.4]))


def wide_too(key):
    return replace(built_in.sample(key, 1), size_xy=jnp.array([3.0, 1.4]))


FAMILIES = ("bump", Family("wide", wide), "gate", Family("wide too", wide_too), "stairs")


def test_families_of_one_size_are_one_kind():
    narrow, broad = kinds_of(FAMILIES)
    assert (narrow.places, narrow.size_xy) == ((0, 2, 4), (1.8, 1.4))
    assert (broad.places, broad.size_xy) == ((1, 3), (3.0, 1.4))
    assert [kind.number for kind in (narrow, broad)] == [5, 5] and len(kinds_of(("bump", "gate"))) == 1


@pytest.mark.parametrize("size", [1, 2, 4, 5, 7, 10, 16])
@pytest.mark.parametrize("total", [1, 5, 16, 23])
def test_every_arena_is_in_one_kind_and_one_block(size, total):
    """Against a plain loop; all blocks of a kind have as many slots, and real arenas come first."""
    size = min(size, total)
    for kind in kinds_of(FAMILIES):
        found = []
        for first in range(0, total, size):
            count = kind.count(first, min(size, total - first))
            index = kind.indices(first, size)
            assert len(index) == kind.slots(size) >= count and (np.diff(index) > 0).all()
            assert (index[:count] < first + size).all() and (index[count:] >= first + min(size, total - first)).all()
            assert all(kind.families[turn] == FAMILIES[k % 5] for k, turn in zip(index, kind.turns(index), strict=True))
            found += index[:count].tolist()
        assert found == [k for k in range(total) if k % 5 in kind.places]


def test_a_study_of_one_kind_has_the_arenas_that_it_had():
    np.testing.assert_array_equal(ANY.indices(6, 4), [6, 7, 8, 9])
    assert ANY.slots(7) == 7 and ANY.count(3, 5) == 5


def test_arenas_do_not_depend_on_the_other_kinds():
    key = jax.random.key(3)
    for kind in kinds_of(FAMILIES):
        index = kind.indices(0, 10)
        arenas, seeds = draw(key, jnp.asarray(index), kind.families, None, jnp.asarray(kind.turns(index)))
        np.testing.assert_allclose(arenas.size_xy, np.tile(kind.size_xy, (len(index), 1)), rtol=1e-6)
        if kind.size_xy == (1.8, 1.4):
            plain, others = draw(key, jnp.arange(10), ("bump", "obstacles", "gate", "clutter", "stairs"))
            np.testing.assert_array_equal(arenas.goal_xy, plain.goal_xy[index])
            np.testing.assert_array_equal(seeds, others[index])


def test_each_kind_has_a_program_of_its_own():
    groups = group_points(only_point(StudyConfig()), ("full", "floor_only"), kinds_of(FAMILIES))
    assert [group.spec.grid.size_x for group in groups] == [1.8, 3.0]
    with pytest.raises(jb.InputError, match="does not support terrain"):
        terrain = kinds_of((scene_family(CONFIGS / "terrain" / "stairs.toml"),))
        config = StudyConfig(mission={"executor": "native"})
        group_points(only_point(config), ("full",), terrain)


@pytest.mark.slow
def test_scenes_of_three_sizes_one_of_them_with_terrain():
    files = [CONFIGS / "scenes" / "experiment_1.toml", CONFIGS / "terrain" / "stairs.toml"]
    corridor = jb.Family("corridor", wide)
    results = jb.evaluate(jb.Study(jb.RandomArenas([*map(str, files), corridor], 7), ["full"], seed=2, shard=3))
    rows = results.rows.sort("arena")
    assert rows["arena"].to_list() == list(range(7)) and set(SCHEMA.names()) < set(rows.columns)
    assert rows["family"].to_list() == ["experiment_1", "scene stairs", "corridor"] * 2 + ["experiment_1"]
    assert (rows.filter(family="scene stairs")["code"] == "reached").all()
    mission = results.replay("full", 1)
    assert mission.code == rows["code"][1] and mission.distance == pytest.approx(rows["walked"][1], abs=1e-6)
