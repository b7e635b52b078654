"""Ray casting in its corner cases; whole images are checked in tests/sensing/test_raycast.py."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped.geometry.boxes import Boxes
from jaxbiped.geometry.rays import INSIDE, cast_boxes, cast_floor, key, marked, nearness
from jaxbiped.geometry.small import matrix, product

# Rays look along world x; x of a ray is to the world's y, y of a ray is up.
BASIS = jnp.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])


def boxes(*rows, used=True):
    """Rows of (x, y, yaw, half_x, half_y, bottom, top)."""
    table = np.array(rows, np.float32).reshape(-1, 7)
    n = len(table)
    return Boxes(*jnp.asarray(table.T), jnp.zeros(n, bool), jnp.ones(n), jnp.full(n, used))


@jax.jit
def cast(some, origin, x, y, marks):
    return cast_boxes(some, marks, origin, BASIS, x, y, jnp.zeros(x.shape, jnp.int32))


def depth(some, origin, x=(0.0,), y=(0.0,)):
    marks = jnp.zeros(some.x.shape, bool)
    with np.errstate(divide="ignore"):
        return 1 / np.asarray(nearness(cast(some, jnp.array(origin), jnp.array(x), jnp.array(y), marks)))


UNIT = boxes((2, 0, 0, 1, 1, 0, 2))


def test_faces_edges_and_misses():
    found = depth(UNIT, [0.0, 0, 1], x=[0, 0.5, 2.0, 0, 0], y=[0, 0, 0, 0.5, -0.99])
    assert np.allclose(found, [1, 1, np.inf, 1, 1], rtol=1e-5)
    assert np.isinf(depth(UNIT, [4.0, 0, 1]))  # behind the origin
    assert np.allclose(depth(UNIT, [0.0, 0, 3], y=[-0.8]), 1.25)  # its top, from above


def test_rays_along_faces_neither_fail_nor_lie():
    """Exactly parallel to two pairs of faces, inside or outside of them, or in them."""
    assert np.allclose(depth(UNIT, [0.0, 0.3, 1]), 1, rtol=1e-6)
    assert np.isinf(depth(UNIT, [0.0, 1.5, 1])) and np.isinf(depth(UNIT, [0.0, 0, 2.5]))
    assert not np.isnan(depth(UNIT, [0.0, 1.0, 1])).any()  # in a face: either answer


def test_yaw_turns_the_box():
    assert np.allclose(depth(boxes((2, 0, np.pi / 4, 1, 1, 0, 2)), [0.0, 0, 1]), 2 - np.sqrt(2), rtol=1e-5)


def test_inside_and_on_the_face():
    assert np.allclose(depth(UNIT, [2.0, 0, 1]), 1 / INSIDE)
    assert depth(UNIT, [1.0 + 1e-6, 0, 1]) <= 1e-6 and not np.isnan(depth(UNIT, [1.0, 0, 1]))


def test_nearest_box_wins_and_tells_its_mark():
    two = boxes((4, 0, 0, 1, 1, 0, 2), (2, 0, 0, 0.5, 0.5, 0, 2))
    x, y = jnp.array([0.0, 0.25]), jnp.zeros(2)
    for marks in ([True, False], [False, True]):
        keys = cast(two, jnp.array([0.0, 0, 1]), x, y, jnp.array(marks))
        assert np.allclose(1 / nearness(keys), [1.5, 1.5], rtol=1e-6) and np.all(marked(keys) == marks[1])


def test_background_shows_where_no_box_is_nearer():
    background = key(jnp.array([0.1, 5.0]), jnp.array(True))
    some = cast_boxes(UNIT, jnp.array([False]), jnp.array([0.0, 0, 1]), BASIS, jnp.zeros(2), jnp.zeros(2), background)
    assert np.allclose(nearness(some), [1, 5]) and marked(some).tolist() == [False, True]


def test_no_boxes_unused_boxes_and_nan():
    origin = [0.0, 0, 1]
    assert np.isinf(depth(boxes(), origin))
    assert np.isinf(depth(boxes((2, 0, 0, 1, 1, 0, 2), used=False), origin))
    assert np.isinf(depth(boxes([np.nan] * 7, used=False), origin)) and np.isinf(depth(boxes([np.nan] * 7), origin))
    assert np.isinf(depth(UNIT, [np.nan, 0, 1]))
    assert np.isinf(depth(boxes((0, 0, 0, 1, 1, 0, 2), used=False), origin))  # around the origin


def test_floor_ends_with_the_arena():
    size, origin = jnp.array([2.0, 1.0]), jnp.array([0.5, 0.5, 0.5])
    floor = lambda origin, x, y: np.asarray(cast_floor(size, origin, BASIS, jnp.array(x), jnp.array(y)))  # noqa: E731
    found = floor(origin, [0, 0, 0, 0.6, 0.4], [-0.5, -0.3, 0.5, -0.5, -0.5])
    assert np.allclose(found, [1, 0, 0, 0, 1])  # ahead; beyond the far edge; up; beyond the side; within
    assert not floor(origin.at[2].set(-1), [0.0], [-0.5]).any() and not floor(origin * jnp.nan, [0.0], [-0.5]).any()


def test_small_matrices():
    a, b = np.random.default_rng(0).normal(size=(2, 3, 3)).astype(np.float32)
    assert np.allclose(product(jnp.asarray(a), jnp.asarray(b)), a @ b, atol=1e-6)
    assert np.array_equal(matrix(tuple(tuple(jnp.asarray(v) for v in row) for row in a)), a)
