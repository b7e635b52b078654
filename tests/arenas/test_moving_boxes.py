"""Boxes that move: where they are, and that they keep clear of start, goal and rim."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.arenas import KNOWN, PopulationConfig, at_time, only, sample
from jaxbiped.arenas.families import CLEARANCE, SIZE_X, SIZE_Y
from jaxbiped.arenas.moving_boxes import boxes_at

KEY = jax.random.key(4)
COUNT = 60


def draw(families, population=None):
    return jax.jit(jax.vmap(partial(sample, KEY, families=families, population=population)))(jnp.arange(COUNT))


@pytest.fixture(scope="module")
def traffic():
    return draw(("traffic",))


def by_small_steps(start, end, speed, phase, time, steps=4000):
    """Where a box is that goes to and fro, step by step."""
    way = np.hypot(*(end - start))
    forward, gone = phase < 1, (phase if phase < 1 else 2 - phase) * way
    for _ in range(steps):
        gone += (1 if forward else -1) * speed * time / steps
        if gone >= way:
            forward = False
        elif gone <= 0:
            forward = True
    return start + (end - start) * gone / way


def test_they_go_to_and_fro_at_their_speed(traffic):
    time, rng = 300.0, np.random.default_rng(0)
    now = jax.vmap(partial(boxes_at, time=time))(traffic)
    moving = np.argwhere(np.asarray(traffic.boxes.used))
    for k, m in rng.permutation(moving)[:8]:
        boxes, movers = traffic.boxes, traffic.movers
        start = np.array([boxes.x[k, m], boxes.y[k, m]], float)
        end = start + np.array([movers.dx[k, m], movers.dy[k, m]])
        there = by_small_steps(start, end, float(movers.speed[k, m]), float(movers.phase[k, m]), time)
        # A turn at an end is off by less than a step of 0.02 * 300 / 4000 m, and there are up to eight turns.
        np.testing.assert_allclose([now.x[k, m], now.y[k, m]], there, atol=8 * 2 * 0.02 * time / 4000)


def test_they_stay_inside_and_clear_of_start_and_goal(traffic):
    assert np.all(np.asarray(traffic.boxes.used.sum(1)) >= 1) and np.all(np.asarray(traffic.boxes.used.sum(1)) <= 4)
    for time in np.linspace(0, 900, 30):
        now = jax.vmap(partial(boxes_at, time=time))(traffic)
        x, y = (np.asarray(v)[np.asarray(now.used)] for v in (now.x, now.y))
        half = 0.07 * np.sqrt(2)
        assert x.min() > half and x.max() < SIZE_X - half and y.min() > half and y.max() < SIZE_Y - half
        for ends in (traffic.start_xyyaw[:, :2], traffic.goal_xy):
            away = np.hypot(now.x - ends[:, :1], now.y - ends[:, 1:])[np.asarray(now.used)]
            assert away.min() > CLEARANCE


def test_speed_is_fixed_by_the_population_and_nothing_else_changes(traffic):
    fixed = draw(("traffic",), PopulationConfig(obstacle_speed=0.005).traced())
    np.testing.assert_array_equal(fixed.movers.speed[np.asarray(fixed.boxes.used)], np.float32(0.005))
    for a, b in zip(jax.tree.leaves(fixed.boxes), jax.tree.leaves(traffic.boxes), strict=True):
        np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(fixed.movers.dx, traffic.movers.dx)


def test_other_families_stand_and_are_the_same_beside_traffic():
    mixed, alone = draw(("bump", "traffic")), draw(("bump",))
    assert alone.movers is None
    bump = np.asarray(mixed.family) == KNOWN.index("bump")
    assert bump.sum() == COUNT // 2 and not np.asarray(mixed.movers.speed)[bump].any()
    even = jax.tree.map(lambda leaf: np.asarray(leaf)[::2], mixed)
    for name in ("x", "y", "half_x", "half_y", "used"):
        np.testing.assert_array_equal(getattr(even.boxes, name), np.asarray(getattr(alone.boxes, name))[::2])
    late = jax.vmap(partial(at_time, time=77.0))(mixed)
    np.testing.assert_array_equal(np.asarray(late.boxes.x)[bump], np.asarray(mixed.boxes.x)[bump])


def test_what_moves_and_what_stands_part(traffic):
    still, moving = (jax.vmap(partial(only, moving=which))(traffic) for which in (False, True))
    assert still.movers is None and moving.movers is not None
    parts = np.asarray(still.boxes.used).astype(int) + np.asarray(moving.boxes.used)
    np.testing.assert_array_equal(parts, np.asarray(traffic.boxes.used))
    slow = jax.tree.map(lambda leaf: leaf[0], traffic)
    slow = replace(slow, movers=replace(slow.movers, speed=jnp.zeros_like(slow.movers.speed)))
    stands = only(slow, moving=False)
    assert np.asarray(stands.boxes.used).sum() == np.asarray(slow.boxes.used).sum()
    np.testing.assert_allclose(stands.boxes.x, boxes_at(slow, 500.0).x)  # at its phase, for ever


def test_arenas_without_movers_are_handed_back(traffic):
    alone = jax.tree.map(lambda leaf: leaf[0], draw(("bump",)))
    assert at_time(alone, 3.0) is alone and only(alone, moving=False) is alone
