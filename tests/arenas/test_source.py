"""Families that people bring, and scenes, taking turns with those that are built in."""

from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.arenas import families as built_in
from jaxbiped.arenas.source import Family, draw_arena, find_family, name_of, scene_family, size_of, terrain_of
from jaxbiped.errors import InputError

SCENES = Path(__file__).parents[2] / "configs" / "scenes"
KEY = jax.random.key(3)


def plain(key):
    """One wall of random length, in an arena with few slots."""
    made = built_in.sample(key, 0, ("obstacles",))
    some = jax.tree.map(lambda leaf: leaf[:2], made.boxes)
    return replace(made, boxes=replace(some, half_y=0.1 + 0.2 * jax.random.uniform(key, (2,))))


def many(key):
    """More boxes than any family that is built in."""
    made = built_in.sample(key, 0, ("clutter",))
    return replace(made, boxes=jax.tree.map(lambda leaf: jnp.concatenate([leaf, leaf]), made.boxes))


def drawn(families, count=9):
    draw = jax.jit(jax.vmap(lambda k: draw_arena(KEY, k, families)))
    return jax.device_get(draw(jnp.arange(count)))


def same(one, other):
    """But for the last bit: one is computed alone, the other inside a larger program."""
    np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-7)


def test_families_take_turns_and_those_built_in_stay_what_they_are_alone():
    mixed = drawn(("bump", Family("mine", plain), "gate"))
    assert mixed.boxes.x.shape == (9, built_in.MAX_BOXES)
    for place, name in ((0, "bump"), (2, "gate")):
        for k in range(place, 9, 3):
            alone = jax.device_get(built_in.sample(KEY, k, (name,)))
            here = jax.tree.map(lambda leaf, k=k: leaf[k], mixed)
            jax.tree.map(same, replace(here, family=alone.family), alone)
    for k in (1, 4, 7):
        own = jax.device_get(plain(jax.random.fold_in(jax.random.fold_in(KEY, k), 2)))
        np.testing.assert_allclose(mixed.boxes.half_y[k, :2], own.boxes.half_y, rtol=1e-6)
        assert not mixed.boxes.used[k, 2:].any()


def test_without_own_families_nothing_changes():
    jax.tree.map(np.testing.assert_array_equal, drawn(("bump", "gate")), jax.device_get(
        jax.jit(jax.vmap(lambda k: built_in.sample(KEY, k, ("bump", "gate"))))(jnp.arange(9))))  # fmt: skip


def test_more_boxes_than_any_other_family_has():
    assert drawn((Family("many", many), "bump")).boxes.x.shape == (9, 2 * built_in.MAX_BOXES)
    assert drawn((Family("many", many),)).boxes.x.shape == (9, 2 * built_in.MAX_BOXES)


def test_scenes_are_families_with_one_arena():
    paths = sorted(SCENES.glob("experiment_*.toml"))
    scenes = tuple(map(scene_family, paths))
    assert [name_of(item) for item in scenes] == [path.stem for path in paths]
    arenas = drawn(scenes)
    for k in range(9):
        np.testing.assert_array_equal(arenas.goal_xy[k], scenes[k % len(paths)].scene.goal_xy)
    assert scene_family(paths[0]) == scenes[0] and hash(scene_family(paths[0])) == hash(scenes[0])


def test_a_changed_scene_is_another_family(tmp_path):
    path = tmp_path / "s.toml"
    text = (SCENES / "experiment_1.toml").read_text()
    path.write_text(text)
    before = scene_family(path)
    path.write_text(text + "# changed\n")
    assert scene_family(path) != before and scene_family(path).digest() != before.digest()


def wrong(**changes):
    return lambda key: replace(built_in.sample(key, 0), **changes)


@pytest.mark.parametrize(
    "generator, match",
    [
        (lambda key: None, "must return an Arena, not NoneType"),
        (lambda key: built_in.sample(key, 0, ("traffic",)), "boxes that move"),
        (wrong(goal_xy=jnp.zeros(3)), r"goal_xy: its generator returned \[3\] where \[2\]"),
        (wrong(difficulty=jnp.zeros(1)), r"difficulty: its generator returned \[1\]"),
        (lambda key: jax.vmap(lambda k: built_in.sample(key, k))(jnp.arange(2)), r"returned \[2, 2\]"),
    ],
)
def test_generators_that_return_something_else_are_named(generator, match):
    with pytest.raises(InputError, match=match):
        drawn((Family("lab", generator),))


def test_sizes_of_families():
    wide = Family("wide", wrong(size_xy=jnp.array([3.0, 1.4])))
    assert size_of(wide) == (3.0, 1.4) and size_of("bump") == (1.8, 1.4)
    stairs = scene_family(SCENES.parent / "terrain" / "stairs.toml")
    assert (
        stairs.name == "scene stairs"
        and terrain_of(stairs) is not None
        and terrain_of(wide) is None
        and terrain_of("bump") is None
    )


def test_names_that_are_not_known_are_refused(tmp_path):
    with pytest.raises(InputError, match="family: must be one of"):
        find_family("mountains")
    with pytest.raises(InputError, match=r"no\.toml"):
        find_family(str(tmp_path / "no.toml"))
    assert find_family("bump") == "bump"
