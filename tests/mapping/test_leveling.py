"""Floor-plane refit on hand-made views: what it must level, and what it must leave alone."""

import jax
import numpy as np
import pytest

from jaxbiped.mapping.leveling import level_view
from jaxbiped.sensing.view import View
from tests.mapping.scenes import PARAMS, SPEC, plane, view, wall

LEVEL = jax.jit(level_view, static_argnames="spec")
FLOOR = plane((0.15, 1.7), (-0.8, 0.8), 0.0, step=0.02)


def tilted(points, roll, pitch, offset=0.0, noise=0.002):
    """Points [n, 3] of a robot that rolls to the right and pitches down by so many degrees without knowing it."""
    roll, pitch = np.deg2rad([roll, pitch])
    x, y, z = np.transpose(points)
    z = z + pitch * x + roll * y + offset + noise * np.random.default_rng(0).normal(size=len(x))
    return np.column_stack([x - pitch * points[:, 2], y - roll * points[:, 2], z])


def leveled(points, support=0.0, **kwargs):
    result = LEVEL(view(points, **kwargs), support, PARAMS, spec=SPEC)
    return np.column_stack([result.x, result.y, result.z])[: len(points)]


def bumps(heights):
    """The floor with bars of these heights across the way, 20 cm each, from 30 cm on."""
    points = FLOOR.copy()
    for k, height in enumerate(heights):
        bar = (points[:, 0] > 0.3 + 0.2 * k) & (points[:, 0] < 0.5 + 0.2 * k)
        points[bar, 2] = height
    return points


SCENES = {
    "floor": (FLOOR, 0.0),
    "a bump near by": (bumps([0.03]), 0.0),
    "bumps fill the view": (bumps([0.03] * 6), 0.0),
    "stairs": (bumps([0.03, 0.06, 0.06, 0.03]), 0.0),
    "a wall behind": (np.concatenate([FLOOR, wall((1.0, 1.0), (-0.8, 0.8), (0.0, 0.5), step=0.02)]), 0.0),
    "from a bump of level 1": (bumps([0.03]) - [0, 0, 0.03], 0.03),
    "from a bump of level 2": (bumps([0.06, 0.03]) - [0, 0, 0.06], 0.06),
}


@pytest.mark.parametrize(("roll", "pitch"), [(0, 0), (1, 1), (-1, -1), (0, 1.5), (1, -1.5)])
@pytest.mark.parametrize("scene", SCENES)
def test_levels_come_out(scene, roll, pitch):
    points, support = SCENES[scene]
    got = leveled(tilted(points, roll, pitch), support)
    ground = points[:, 2] < 0.07
    # 4 mm is a quarter of what would make a wrong level; one degree at the far end is 30.
    assert np.abs(got - points)[ground].max() < 0.004 + 4 * 0.002
    assert np.abs(np.mean((got - points)[ground], axis=0)).max() < 0.002
    assert (np.round(got[ground, 2] / 0.03) == np.round(points[ground, 2] / 0.03)).mean() > 0.999


@pytest.mark.parametrize("height", [0.016, 0.018, 0.025, 0.035, 0.04, 0.045, 0.05, 0.055])
@pytest.mark.parametrize("first", [0.2, 0.4], ids=["fills the view", "ahead"])
def test_a_bump_of_any_height_neither_lifts_nor_tilts_the_floor(height, first):
    """Snapped to a level it would be taken for one of 3 or 6 cm, and the floor for lower or higher by the rest."""
    points = FLOOR.copy()
    bump = points[:, 0] > first
    points[bump, 2] = height
    got = leveled(tilted(points, 0.2, -0.3))
    near = points[:, 0] < 0.6  # where heights decide on a step
    assert np.abs(np.mean(got[bump & near, 2]) - height) < 0.0018  # `PLAIN`, and noise
    assert np.abs(np.mean(got[~bump & near, 2])) < 0.0018
    assert np.abs(np.mean(got[bump, 2]) - height) < 0.004


def test_seen_from_a_bump_of_an_odd_height_the_floor_lies_as_much_lower():
    points = bumps([0.0]) - [0, 0, 0.024]
    got = leveled(tilted(points, 0.2, 0.3), 0.024)
    assert np.abs(np.mean(got[:, 2]) + 0.024) < 0.001


def test_outliers_do_not_matter():
    rng = np.random.default_rng(1)
    wild = np.column_stack([rng.uniform(0.2, 1.5, 1500), rng.uniform(-0.7, 0.7, 1500), rng.uniform(-0.3, 0.6, 1500)])
    got = leveled(np.concatenate([tilted(FLOOR, 1, 1), wild]))[: len(FLOOR)]
    assert np.abs(got - FLOOR).max() < 0.012


@pytest.mark.parametrize(
    "points",
    [
        np.zeros((0, 3)),
        tilted(FLOOR, 0, 6),  # a ramp
        wall((0.6, 0.6), (-0.5, 0.5), (0.1, 0.5)),  # no floor in sight
        FLOOR[:10],  # too little of it
        np.full((500, 3), np.nan),
        np.full((500, 3), np.inf),
        np.full((500, 3), 1e30),
    ],
    ids=["nothing", "steep", "wall", "few", "nan", "inf", "huge"],
)
def test_views_that_show_no_floor_stay_as_they_are(points):
    got, points = leveled(points), np.float32(points)
    finite = np.isfinite(points)
    np.testing.assert_array_equal(got[finite], points[finite])
    assert not np.isfinite(got[~finite]).any()


def test_points_without_weight_take_no_part():
    mixed = np.concatenate([tilted(FLOOR, 0, 1), tilted(FLOOR, 0, -3)])
    full = view(mixed)
    weight = full.weight.at[len(FLOOR) :].set(0)
    got = LEVEL(View(full.x, full.y, full.z, weight), 0.0, PARAMS, spec=SPEC)
    assert np.abs(np.asarray(got.z)[: len(FLOOR)]).max() < 0.012
