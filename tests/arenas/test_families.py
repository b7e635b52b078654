"""Random arenas: sound, the same in any batch, and harder where they say so."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.arenas import FAMILIES, sample
from jaxbiped.arenas.families import BUMP, CLEARANCE, LINTEL, MAX_BOXES, SIZE_X, SIZE_Y

COUNT = 600  # 100 of each family
KEY = jax.random.key(11)


@pytest.fixture(scope="module")
def arenas():
    return jax.device_get(jax.jit(jax.vmap(partial(sample, KEY)))(jnp.arange(COUNT)))


def corners(boxes):
    """[N, M, 4, 2] of the footprints."""
    cos, sin = np.cos(boxes.yaw), np.sin(boxes.yaw)
    out = []
    for sx, sy in ((1, 1), (1, -1), (-1, -1), (-1, 1)):
        x, y = sx * boxes.half_x, sy * boxes.half_y
        out.append(np.stack([boxes.x + cos * x - sin * y, boxes.y + sin * x + cos * y], -1))
    return np.stack(out, 2)


def distance(boxes, xy):
    """[N, M] in plan from one point of each arena."""
    cos, sin = np.cos(boxes.yaw), np.sin(boxes.yaw)
    dx, dy = xy[:, :1] - boxes.x, xy[:, 1:] - boxes.y
    along = np.maximum(abs(cos * dx + sin * dy) - boxes.half_x, 0)
    return np.hypot(along, np.maximum(abs(cos * dy - sin * dx) - boxes.half_y, 0))


def test_boxes_lie_nearly_inside_the_area(arenas):
    at = corners(arenas.boxes)[arenas.boxes.used]
    assert at.min() > -0.01 and np.all(at.max((0, 1)) < np.array([SIZE_X, SIZE_Y]) + 0.01)


def test_boxes_lie_inside_the_area(arenas):
    at = corners(arenas.boxes)[arenas.boxes.used]
    assert at.min() > -1e-5 and np.all(at.max((0, 1)) < np.array([SIZE_X, SIZE_Y]) + 1e-5)


def test_start_and_goal_are_free(arenas):
    boxes = arenas.boxes
    for ends in (arenas.start_xyyaw[:, :2], arenas.goal_xy):
        near = np.where(boxes.used & (boxes.top > BUMP), distance(boxes, ends), np.inf)
        assert near.min() > CLEARANCE
        on = np.where(boxes.used, distance(boxes, ends), np.inf)
        assert on.min() > 0.1 - 1e-6
        assert np.all((ends > 0.2) & (ends < np.array([SIZE_X, SIZE_Y]) - 0.2))


def test_boxes_are_sound(arenas):
    boxes = jax.tree.map(lambda leaf: leaf[arenas.boxes.used], arenas.boxes)
    assert np.all((boxes.half_x > 0.02) & (boxes.half_y > 0.02) & (boxes.top > boxes.bottom) & (boxes.bottom >= 0))
    np.testing.assert_array_equal(boxes.overhead, boxes.bottom > 0)
    assert np.all((boxes.contrast >= 0.5) & (boxes.contrast <= 1))
    # Nothing between what can be stepped on and what is an obstacle for certain.
    steps, solid = np.isclose(boxes.top, BUMP) | np.isclose(boxes.top, 2 * BUMP), boxes.top >= 0.09
    assert np.all(steps | solid)
    assert np.allclose(boxes.bottom[boxes.overhead], LINTEL)


@pytest.mark.parametrize("name", FAMILIES)
def test_families_have_what_they_are_named_for(arenas, name):
    of = arenas.family == FAMILIES.index(name)
    assert of.sum() == COUNT // len(FAMILIES)
    boxes = arenas.boxes
    bump = (boxes.used & (boxes.top <= 2 * BUMP + 1e-6)).any(1)[of]
    lintel = (boxes.used & boxes.overhead).any(1)[of]
    block = (boxes.used & (boxes.top > 0.08) & ~boxes.overhead).any(1)[of]
    most = {"bump": bump, "stairs": bump, "gate": lintel & block, "mixed": lintel & bump}.get(name, block)
    assert most.mean() > 0.7  # boxes that would stand on the start or the goal are left out
    if name in ("obstacles", "gate"):
        assert not bump.any()
    if name in ("obstacles", "bump", "stairs", "clutter"):
        assert not lintel.any()
    if name in ("bump", "stairs"):
        assert not block.any()


def test_arena_is_the_same_in_any_batch(arenas):
    order = np.random.default_rng(0).permutation(COUNT)[:50]
    again = jax.device_get(jax.jit(jax.vmap(partial(sample, KEY)))(jnp.asarray(order)))
    for one, all_of_them in zip(jax.tree.leaves(again), jax.tree.leaves(arenas), strict=True):
        np.testing.assert_allclose(one, all_of_them[order], rtol=0, atol=1e-6)
    alone = jax.device_get(jax.jit(partial(sample, KEY))(order[0]))
    for one, all_of_them in zip(jax.tree.leaves(alone), jax.tree.leaves(arenas), strict=True):
        np.testing.assert_allclose(one, all_of_them[order[0]], rtol=0, atol=1e-6)


def test_arenas_of_other_keys_and_numbers_differ(arenas):
    other = jax.device_get(jax.jit(jax.vmap(partial(sample, jax.random.key(12))))(jnp.arange(COUNT)))
    assert not np.any(np.all(np.isclose(other.start_xyyaw, arenas.start_xyyaw), axis=1))
    assert len(np.unique(arenas.start_xyyaw[:, 0])) > 0.99 * COUNT


def test_one_family_alone_takes_every_turn():
    gates = jax.device_get(jax.vmap(partial(sample, KEY, families=("gate", "bump")))(jnp.arange(8)))
    assert gates.family.tolist() == [FAMILIES.index("gate"), FAMILIES.index("bump")] * 4


def test_difficulty_is_uniform_on_the_unit_interval(arenas):
    for family in range(len(FAMILIES)):
        values = np.sort(arenas.difficulty[arenas.family == family])
        assert values[0] >= 0 and values[-1] < 1
        gap = np.abs(values - (np.arange(len(values)) + 0.5) / len(values)).max()
        assert gap < 1.63 / np.sqrt(len(values))  # Kolmogorov-Smirnov at 1 %


def barred(boxes):
    """How much is in the way: area of obstacles, and length of what spans the area, summed over boxes."""
    return {
        "obstacles": np.sum(boxes.used * 4 * boxes.half_x * boxes.half_y, 1),
        "bump": np.max(boxes.used * boxes.half_y, 1),
        "stairs": np.max(boxes.used * boxes.half_y, 1),
        "gate": np.max(boxes.used * ~boxes.overhead * boxes.half_y, 1),
        "mixed": np.max(boxes.used * (boxes.top > 0.4) * ~boxes.overhead * boxes.half_y, 1),
        "clutter": np.sum(boxes.used, 1),
    }


@pytest.mark.parametrize("name", FAMILIES)
def test_harder_arenas_bar_more(arenas, name):
    """Difficulty lengthens bars and walls, makes blocks more and larger: its rank correlation with that is high."""
    of = arenas.family == FAMILIES.index(name)
    amount = barred(arenas.boxes)[name][of]
    ranks = [np.argsort(np.argsort(values)) for values in (arenas.difficulty[of], amount)]
    assert np.corrcoef(*ranks)[0, 1] > 0.6


def test_landmarks_are_in_the_open(arenas):
    marks = arenas.landmarks
    for n in range(marks.x.shape[1]):
        near = np.where(arenas.boxes.used, distance(arenas.boxes, np.stack([marks.x[:, n], marks.y[:, n]], 1)), np.inf)
        assert np.all(near.min(1)[marks.used[:, n]] >= 0.08)
    assert np.all((marks.x > 0) & (marks.x < SIZE_X) & (marks.y > 0) & (marks.y < SIZE_Y))
    assert marks.used.sum(1).mean() > 3
    assert arenas.boxes.x.shape[1] == MAX_BOXES
