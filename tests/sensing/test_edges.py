"""Edges of bumps, measured from views, against the truth and against a general optimiser."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.optimize

from jaxbiped.mapping import GridSpec, MapConfig, level_view
from jaxbiped.sensing import PRESETS, View, edges, measure_raycast
from jaxbiped.sensing.camera import mount
from tests.sensing.scenes import CAMERA, IMAGE, as_jax, make, pose

RISE = 0.03  # [m]
VIEWS = 64
NOISE = PRESETS["rendered"].stereo.traced()
PARAMS, SPEC = MapConfig().params(), GridSpec()


def about(distance, angle, rise, known=True):
    number = [jnp.asarray(v, jnp.float32) for v in (distance, angle)]
    return edges.Edge(*number, edges.prior_cov(), jnp.int32(rise), jnp.asarray(known))


def bump(distance, angle, rise, deep=0.30, half_width=0.5, aside=0.0):
    """A robot at the middle of the area, its heading along x, and the bump whose edge lies ahead of it."""
    sign = 1 if rise > 0 else -1
    along = distance + sign * deep / 2
    x = 0.9 + along * np.cos(angle) - aside * np.sin(angle)
    y = 0.7 + along * np.sin(angle) + aside * np.cos(angle)
    return make([(x, y, angle, deep / 2, half_width, 0.0, RISE)]), pose(0.9, 0.7, z=0.0 if rise > 0 else RISE)


@jax.jit
def view_of(arena, where, seed, look):
    view = measure_raycast(arena, where, CAMERA, NOISE, IMAGE, seed, look, False)
    return level_view(view, where.z, PARAMS, SPEC)


@jax.jit
def measured(arena, where, seed, look, guess):
    return edges.measure(view_of(arena, where, seed, look), guess, 0.0, mount(CAMERA, look), RISE)


def errors(rise, look, distances, turned, **shape):
    """[VIEWS] errors [m, rad] of lines that were looked for off their place, and whether each was found."""
    rng = np.random.default_rng(7)
    found = []
    for k in range(VIEWS):
        distance, angle = rng.uniform(*distances), rng.uniform(-turned, turned)
        guess = about(distance + rng.normal(0, 0.015), angle + rng.normal(0, 0.12), rise)
        line = measured(*as_jax(bump(distance, angle, rise, **shape)), jnp.uint32(k), jnp.asarray(look), guess)
        found.append((line.distance - distance, line.angle - angle, line.known))
    off, askew, known = np.array(found, float).T
    return off[known > 0], askew[known > 0], known


# What a step over an edge allows: 8 mm and 6 degrees (`motion.robot.FootingConfig`). Both with room for walking.
CASES = {
    "up, from afar": (1, False, (0.18, 0.30), 0.0025, 2.5),
    "up, before the feet": (1, True, (0.06, 0.12), 0.0060, 4.5),
    "down, from afar": (-1, False, (0.20, 0.28), 0.0080, 5.5),
    "down, before the feet": (-1, True, (0.015, 0.08), 0.0070, 4.5),
}


@pytest.mark.parametrize("turned", [0.0, 0.4])
@pytest.mark.parametrize("name", CASES)
def test_edge_is_where_it_is(name, turned):
    rise, look, distances, most_off, most_askew = CASES[name]
    off, askew, known = errors(rise, look, distances, turned)
    assert known.mean() > 0.98
    assert np.quantile(abs(off), 0.95) < most_off and abs(off.mean()) < 0.0015
    assert np.rad2deg(np.quantile(abs(askew), 0.95)) < most_askew


def test_corner_does_not_turn_the_edge():
    """The bump ends 6 cm to the right of the robot's way: half a foot is beyond its end."""
    off, askew, known = errors(1, True, (0.07, 0.08), 0.1, half_width=0.3, aside=0.3 - 0.06)
    assert known.mean() > 0.9
    assert np.quantile(abs(off), 0.95) < 0.008 and np.rad2deg(np.quantile(abs(askew), 0.9)) < 6


def test_next_edge_is_not_mixed_up():
    """The narrowest bump of the random arenas is 10.5 cm wide."""
    off, _, known = errors(1, True, (0.07, 0.08), 0.1, deep=0.105)
    assert known.mean() > 0.98 and np.quantile(abs(off), 0.95) < 0.006


def test_fit_is_the_optimum():
    """A rising edge, by scipy's optimiser on the same rays and the same sum, in plain NumPy."""
    arena, where = as_jax(bump(0.09, 0.15, 1))
    view = jax.device_get(view_of(arena, where, jnp.uint32(3), jnp.asarray(True)))
    guess = about(0.095, 0.1, 1)
    line = edges.measure(View(*(jnp.asarray(v) for v in vars(view).values())), guess, 0.0, mount(CAMERA, True), RISE)
    share = view.z / RISE
    label = np.clip((share - edges.SOFT) / (1 - 2 * edges.SOFT), 0, 1)
    counts = (view.weight > 0) & (share > -edges.STRAY) & (share < 1 + edges.STRAY)

    def offsets(p):
        off = view.x * np.cos(p[1]) + view.y * np.sin(p[1]) - p[0]
        return off, view.y * np.cos(p[1]) - view.x * np.sin(p[1])

    # The rays that count at the line that was found: which these are changes with the line, and is not searched over.
    off, along = offsets((float(line.distance), float(line.angle)))
    near = counts & (abs(off) < edges.REACH) & (abs(along) < edges.HALF_WIDTH)
    near &= (abs(off) <= edges.CLEAR) | (abs(label - (off > 0)) <= 0.5)

    def loss(p):
        z = offsets(p)[0] / edges.WIDTHS[-1]
        cross_entropy = np.logaddexp(0, z) - label * z
        prior = ((p[0] - 0.095) / edges.PRIOR_DISTANCE) ** 2 + ((p[1] - 0.1) / edges.PRIOR_ANGLE) ** 2
        return (near * cross_entropy).sum() + prior / 2

    best = scipy.optimize.minimize(loss, (0.09, 0.15), method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-8})
    assert bool(line.known)
    assert float(line.distance) == pytest.approx(best.x[0], abs=2e-4)  # rounds end before all digits stand
    assert float(line.angle) == pytest.approx(best.x[1], abs=5e-3)


def nothing(count=100):
    zero = jnp.zeros(count)
    return View(zero, zero, zero, zero)


FLAT = [replace(nothing(), x=jnp.linspace(0.05, 0.2, 100), weight=jnp.ones(100))]
BAD = [replace(FLAT[0], x=jnp.full(100, jnp.nan)), replace(FLAT[0], z=jnp.full(100, jnp.inf))]


@pytest.mark.parametrize("view", [nothing(), *FLAT, *BAD])
def test_where_there_is_no_edge_none_is_found(view):
    line = edges.measure(view, about(0.1, 0.0, 1), 0.0, mount(CAMERA), RISE)
    assert not bool(line.known)
    assert float(line.distance) == pytest.approx(0.1) and bool(jnp.all(jnp.isfinite(line.cov)))


def test_prediction_is_rigid_motion_and_its_noise():
    line = replace(about(0.12, 0.3, 1), cov=jnp.diag(jnp.array([0.003**2, 0.03**2])))
    moved, variances = jnp.array([0.05, -0.02, 0.4]), jnp.array([0.001**2, 0.002**2, 0.01**2])
    after = jax.device_get(edges.predict(line, moved, variances))
    rng = np.random.default_rng(0)
    distance, angle = 0.12 + 0.003 * rng.normal(size=200_000), 0.3 + 0.03 * rng.normal(size=200_000)
    dx, dy, dyaw = np.asarray(moved)[:, None] + np.sqrt(variances)[:, None] * rng.normal(size=(3, 200_000))
    s, a = distance - dx * np.cos(angle) - dy * np.sin(angle), angle - dyaw
    assert after.distance == pytest.approx(0.12 - 0.05 * np.cos(0.3) + 0.02 * np.sin(0.3), abs=1e-6)
    assert after.angle == pytest.approx(-0.1, abs=1e-6)
    np.testing.assert_allclose(after.cov, np.cov(s, a), rtol=0.03, atol=3e-7)


def test_fusion_weighs_by_certainty():
    old = replace(about(0.100, 0.10, 1), cov=jnp.array([[4e-6, 1e-6], [1e-6, 9e-4]]))
    new = replace(about(0.104, 0.06, 1), cov=jnp.array([[9e-6, -1e-6], [-1e-6, 4e-4]]))
    both = jax.device_get(edges.fuse(old, new))
    weights = [np.linalg.inv(np.asarray(e.cov, float)) for e in (old, new)]
    cov = np.linalg.inv(sum(weights))
    mean = cov @ sum(w @ [float(e.distance), float(e.angle)] for w, e in zip(weights, (old, new), strict=True))
    np.testing.assert_allclose([both.distance, both.angle], mean, atol=1e-5)
    np.testing.assert_allclose(both.cov, cov, rtol=1e-3, atol=1e-10)


def test_fusion_of_what_does_not_belong_together():
    old, new = (replace(about(d, 0.0, 1), cov=1e-5 * jnp.eye(2)) for d in (0.1, 0.2))
    assert float(edges.fuse(old, new).distance) == pytest.approx(0.2)  # they disagree: the newer
    assert float(edges.fuse(old, replace(new, known=jnp.asarray(False))).distance) == pytest.approx(0.1)
    assert float(edges.fuse(replace(old, known=jnp.asarray(False)), new).distance) == pytest.approx(0.2)
    assert int(edges.fuse(old, about(0.1, 0.0, -1)).rise) == -1
    neither = edges.fuse(edges.unknown(), edges.unknown())
    assert not bool(neither.known) and bool(jnp.isfinite(neither.distance))
