"""Studies on scenes and on arenas of people's own, with the program of the other studies here."""

from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import polars as pl
import pytest

import jaxbiped as jb
from jaxbiped.api.study import numbers_of_axis
from jaxbiped.arenas import sample
from jaxbiped.statistics.comparison import strata

FILES = sorted((Path(__file__).parents[2] / "configs" / "scenes").glob("experiment_*.toml"))


def test_scenes_take_turns_and_stored_missions_are_played_again(tmp_path):
    study = jb.Study(jb.Scenes(FILES, count=12), ["full"], seed=1)
    results = jb.evaluate(study)
    names = [path.stem for path in FILES]
    rows = results.rows.sort("arena")
    assert rows["family"].to_list() == [names[k % len(names)] for k in range(12)]
    assert (rows["code"] == "reached").sum() >= 9
    assert [item.name for item, _ in strata(rows) if item.kind == "family"] == sorted(names)
    results.save(tmp_path / "scenes")
    again = jb.load(tmp_path / "scenes")
    mission = again.replay("full", 1)
    assert mission.code == rows["code"][1] and mission.distance == pytest.approx(rows["walked"][1], abs=1e-6)
    changed = {**again.config, "components": dict.fromkeys(again.config["components"], "0" * 12)}
    with pytest.raises(jb.InputError, match="has changed since the study"):
        replace(again, config=changed).replay("full", 1)


def two_blocks(key):
    """Blocks left and right of the way, nearer to it where it is harder."""
    arena = sample(key, 0, ("obstacles",))
    y = jnp.where(jnp.arange(12) == 0, 0.35 - 0.15 * arena.difficulty, 1.05 + 0.15 * arena.difficulty)
    boxes = replace(arena.boxes, x=jnp.full(12, 0.9), y=y, yaw=jnp.zeros(12), used=jnp.arange(12) < 2)
    return replace(arena, boxes=boxes, start_xyyaw=jnp.array([0.25, 0.7, 0.0]), goal_xy=jnp.array([1.5, 0.7]))


def test_a_generator_is_a_family_among_others():
    results = jb.evaluate(jb.Study(jb.RandomArenas(["bump", two_blocks], 12), ["full"], seed=1))
    rows = results.rows.sort("arena")
    assert rows["family"].to_list() == ["bump", "two_blocks"] * 6
    assert (rows.filter(pl.col("family") == "two_blocks")["code"] == "reached").all()
    assert set(results.config["components"]) == {"family two_blocks"}


@pytest.mark.parametrize(
    "arenas, match",
    [
        (lambda: jb.Scenes([]), "no scenes"),
        (lambda: jb.Scenes("nowhere.toml"), "nowhere.toml"),
        (lambda: jb.RandomArenas(["mountains"]), "must be one of obstacles"),
        (lambda: jb.RandomArenas([5]), "must be a function of a random key"),
        (lambda: jb.RandomArenas([lambda key: None]), "name of a family"),
        (lambda: jb.RandomArenas([jax.random.normal]), "must return an Arena"),
        (lambda: jb.RandomArenas(["bump", "bump"]), "must be distinct"),
        (lambda: jb.RandomArenas(["bump"], count=0), "greater than or equal to 1"),
    ],
)
def test_arenas_that_are_none_are_named(arenas, match):
    with pytest.raises(jb.InputError, match=match):
        jb.evaluate(jb.Study(arenas(), ["full"]))


def test_boxes_keep_their_contrast_and_only_lists_hold_them():
    plain = jb.Box(centre=(0.9, 0.7), size=(0.2, 0.4), top=0.3, contrast=0.1)
    made = jb.make_arena([(0.5, 0.5, 0, 0.1, 0.1, 0, 0.2), plain], (0.3, 0.7, 0.0), (1.5, 0.7))
    np.testing.assert_allclose(made.boxes.contrast[:3], [1.0, 0.1, 1.0])
    with pytest.raises(jb.InputError, match="boxes: must be a list of boxes"):
        jb.make_arena(plain, (0.3, 0.7, 0.0), (1.5, 0.7))
    with pytest.raises(jb.InputError, match="metrics: must be a list"):
        jb.Study(jb.RandomArenas(count=2), metrics="spl")
    with pytest.raises(jb.InputError, match="metrics: must be a name"):
        jb.Study(jb.RandomArenas(count=2), metrics=[len])
    with pytest.raises(jb.InputError, match=r"axes\.costs\.c3: must be a list of numbers"):
        numbers_of_axis("costs.c3", 1)


def test_boxes_may_be_objects():
    box = jb.Box(centre=(0.9, 0.7), size=(0.2, 0.4), yaw=0.3, bottom=0.1, top=0.3)
    one, other = (jb.make_arena(boxes, (0.3, 0.7, 0.0), (1.5, 0.7)) for boxes in (
        [box, (1, 1, 0, 0, 0, 0, 0)], [(0.9, 0.7, 0.3, 0.2, 0.4, 0.1, 0.3), (1, 1, 0, 0, 0, 0, 0)]))  # fmt: skip
    for ours, theirs in zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True):
        np.testing.assert_array_equal(ours, theirs)
