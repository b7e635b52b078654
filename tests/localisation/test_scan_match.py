"""Laying walls onto walls, against plain NumPy in float64, and where there is nothing to lay."""

import functools
import itertools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.geometry.pose import Pose
from jaxbiped.localisation import Belief
from jaxbiped.localisation import scan_match as ours
from jaxbiped.mapping import GridSpec
from jaxbiped.sensing import View

SPEC = GridSpec()
ROWS, COLUMNS = 12, 16
SD = np.array([0.006, 0.006, 0.02])

found_walls = jax.jit(ours.find_walls, static_argnames=("shape", "step"))
added = jax.jit(ours.add_walls, static_argnames="spec")
lines_of = jax.jit(ours.find_lines, static_argnames="spec")
equations = jax.jit(ours.normal_equations, static_argnames="spec")
matched = jax.jit(ours.match, static_argnames="spec")


def pose(x=0.5, y=0.7, yaw=0.1) -> Pose:
    return Pose(*(jnp.float32(v) for v in (x, y, 0.0, yaw)))


def to_world(at, x, y):
    cos, sin = np.cos(float(at.yaw)), np.sin(float(at.yaw))
    return float(at.x) + cos * x - sin * y, float(at.y) + sin * x + cos * y


def seen_from(at: Pose, world, rng, noise=0.0, sd=0.003) -> ours.Walls:
    """Points of the world [n, 2] as a robot there measures them, in as many slots as a view has."""
    cos, sin = np.cos(float(at.yaw)), np.sin(float(at.yaw))
    dx, dy = (world - [float(at.x), float(at.y)]).T
    local = np.stack([cos * dx + sin * dy, cos * dy - sin * dx]) + rng.normal(0, noise, (2, len(world)))
    slots = np.zeros((2, ours.MOST), np.float32)
    slots[:, : len(world)] = local
    good = np.arange(ours.MOST) < len(world)
    return ours.Walls(*jnp.asarray(slots), jnp.full(ours.MOST, sd**2, jnp.float32), jnp.asarray(good))


def corner(rng, n=300):
    """Points of two walls that meet, off the borders of cells."""
    along = rng.uniform(0, 0.5, n)
    first = rng.random(n) < 0.5
    return np.where(
        first[:, None], np.stack([0.93 + 0 * along, 0.5 + along], 1), np.stack([0.93 + along, 1.02 + 0 * along], 1)
    )


def one_wall(rng, n=300):
    return np.stack([np.full(n, 0.93), rng.uniform(0.4, 1.0, n)], 1)


@pytest.fixture
def rng():
    return np.random.default_rng(3)


def test_upright_points_are_found(rng):
    """A wall on a floor, with a shelf that leans by 45 degrees, in a plain loop over neighbours."""
    step = 2
    run = np.where(np.arange(ROWS) < 5, 0.9, np.where(np.arange(ROWS) < 8, 0.9 - 0.03 * (np.arange(ROWS) - 5), 0.5))
    z = np.where(np.arange(ROWS) < 8, 0.4 - 0.03 * np.arange(ROWS), 0.0)
    run[8:] = 0.9 - 0.1 * np.arange(4)
    bearing = np.linspace(-0.4, 0.4, COLUMNS)
    x, y = (f(bearing)[None] * run[:, None] + rng.normal(0, 1e-3, (ROWS, COLUMNS)) for f in (np.cos, np.sin))
    z = z[:, None] + rng.normal(0, 1e-3, (ROWS, COLUMNS))
    weight = np.where(rng.random((ROWS, COLUMNS)) < 0.9, 64.0, 0.0)
    x[2, 3] = np.nan
    view = View(*(jnp.asarray(v.reshape(-1), jnp.float32) for v in (x, y, z, weight)))
    walls = found_walls(view, (ROWS, COLUMNS), step, jnp.float32(0))
    expected = []
    for r, c in itertools.product(range(ROWS), range(COLUMNS)):
        known = lambda r, c=c: weight[r, c] > 0 and np.isfinite(x[r, c])  # noqa: E731
        for other in (r - step, r + step):
            if 0 <= other < ROWS and known(r) and known(other) and z[r, c] > ours.LOWEST:
                rise, back = abs(z[r, c] - z[other, c]), abs(np.hypot(x, y)[r, c] - np.hypot(x, y)[other, c])
                if rise > ours.UPRIGHT * back:
                    expected.append((x[r, c], y[r, c]))
                    break
    good = np.asarray(walls.good)
    np.testing.assert_allclose(np.stack([walls.x, walls.y], 1)[good], expected, atol=1e-6)
    assert 40 < good.sum() < 120 and np.all(z.reshape(-1)[8 * COLUMNS :] < ours.LOWEST)  # some of it, and no floor


def test_many_points_are_thinned_evenly():
    good = np.zeros((60, 60), bool)
    good[:, ::2] = True
    x = np.arange(3600, dtype=np.float32)
    walls = ours.Walls(jnp.asarray(x), jnp.asarray(x), jnp.ones(3600), jnp.asarray(good.reshape(-1)))
    kept = jax.jit(ours.thinned, static_argnames="shape")(walls, (60, 60))
    taken = np.asarray(kept.x)[np.asarray(kept.good)]
    np.testing.assert_array_equal(taken, x[good.reshape(-1)][::5])  # 1,800 by fives: 360


def test_map_of_lines_is_that_of_eigenvectors(rng):
    at = pose()
    outlines = ours.no_outlines(SPEC)
    world = corner(rng)
    for _ in range(2):
        outlines = added(outlines, seen_from(at, world, rng, 0.002), at, spec=SPEC)
    lines = jax.device_get(lines_of(outlines, spec=SPEC))
    outlines = jax.device_get(outlines)
    own = 0
    for i, j in np.ndindex(SPEC.shape):
        weight = float(outlines.weight[i, j])
        if weight < 1.0:
            continue
        mean = outlines.first[i, j].astype(float) / weight
        xx, xy, yy = outlines.second[i, j].astype(float) / weight
        values, vectors = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]) - np.outer(mean, mean))
        if values[0] < 0.8 * ours.THIN * values[1] and values[1] > 1.2 * ours.LEAST_LENGTH**2:
            own += 1
            assert lines.known[i, j]
            centre = np.array([j + 0.5, i + 0.5]) * SPEC.pitch + mean
            np.testing.assert_allclose([lines.x[i, j], lines.y[i, j]], centre, atol=1e-5)
            assert abs(vectors[:, 0] @ [lines.normal_x[i, j], lines.normal_y[i, j]]) > 0.9999
            assert abs(lines.variance[i, j] - values[0]) < 2e-7
    assert own > 12 and lines.known.sum() > own  # neighbours have them too


def test_normal_equations_of_a_plain_loop(rng):
    at = pose()
    outlines = added(ours.no_outlines(SPEC), seen_from(at, corner(rng), rng, 0.002), at, spec=SPEC)
    lines = lines_of(outlines, spec=SPEC)
    guess = pose(0.503, 0.697, 0.11)
    walls = seen_from(at, corner(rng), rng, 0.002)
    H, b, count = equations(guess, walls, lines, spec=SPEC)
    theirs, plain = jax.device_get((lines, walls))
    sums = np.zeros((3, 3)), np.zeros(3), 0.0
    for n in np.flatnonzero(plain.good):
        x, y = to_world(guess, float(plain.x[n]), float(plain.y[n]))
        i, j = int(y // SPEC.pitch), int(x // SPEC.pitch)
        if not theirs.known[i, j] or np.hypot(x - theirs.x[i, j], y - theirs.y[i, j]) >= ours.REACH:
            continue
        normal = np.array([theirs.normal_x[i, j], theirs.normal_y[i, j]], float)
        distance = normal @ [x - theirs.x[i, j], y - theirs.y[i, j]]
        variance = float(plain.variance[n]) + float(theirs.variance[i, j])
        weight = max(1 - distance**2 / (ours.WIDE**2 * variance), 0) ** 2
        J = np.array([*normal, normal @ [-(y - float(guess.y)), x - float(guess.x)]])
        sums = (
            sums[0] + weight / variance * np.outer(J, J),
            sums[1] + weight / variance * distance * J,
            sums[2] + weight,
        )
    np.testing.assert_allclose(count, sums[2], rtol=1e-3)
    np.testing.assert_allclose(H, sums[0], rtol=2e-3, atol=1e-3 * np.abs(sums[0]).max())
    np.testing.assert_allclose(b, sums[1], atol=5e-3 * np.abs(sums[1]).max())


def mapped(rng, points, views=3):
    """A map of walls that were measured from a few known places."""
    outlines = ours.no_outlines(SPEC)
    for k in range(views):
        at = pose(0.45 + 0.02 * k, 0.7, 0.05 * k)
        outlines = added(outlines, seen_from(at, points(rng), rng, 0.003), at, spec=SPEC)
    return outlines


def off(found: Belief, true: Pose):
    return np.array([found.pose.x - true.x, found.pose.y - true.y, found.pose.yaw - true.yaw])


def believed(true: Pose, error) -> Belief:
    return Belief(ours.pushed(true, jnp.asarray(error, jnp.float32)), jnp.diag(jnp.asarray(SD**2, jnp.float32)))


def test_a_corner_fixes_the_pose_and_a_wall_what_it_can(rng):
    true, error = pose(0.52, 0.71, 0.3), np.array([0.008, -0.007, 0.025])
    both = matched(believed(true, error), seen_from(true, corner(rng), rng, 0.003), mapped(rng, corner), spec=SPEC)
    assert np.all(np.abs(off(both, true)) < [0.003, 0.008, 0.012])
    assert np.all(np.diagonal(both.cov) < (0.75 * SD) ** 2)
    single = matched(
        believed(true, error), seen_from(true, one_wall(rng), rng, 0.003), mapped(rng, one_wall), spec=SPEC
    )
    moved = off(single, true)
    assert abs(moved[0]) < 0.002 and abs(moved[2]) < 0.006
    # Along the wall nothing is learnt: the place there stays as it was believed, and as uncertain, but for what its
    # turning takes along.
    assert abs(moved[1] - error[1]) < 0.001 and single.cov[1, 1] > 0.9 * SD[1] ** 2


def test_errors_are_no_larger_than_claimed(rng):
    """Over 60 beliefs drawn from the prior: mean squared errors at most those claimed, by less than a factor of 6."""
    outlines, nees = mapped(rng, corner), []
    for _ in range(60):
        true = pose(rng.uniform(0.4, 0.6), rng.uniform(0.6, 0.8), rng.uniform(-0.3, 0.3))
        found = matched(
            believed(true, SD * rng.normal(size=3)), seen_from(true, corner(rng), rng, 0.003), outlines, spec=SPEC
        )
        error = off(found, true).astype(float)
        nees.append(error @ np.linalg.solve(np.asarray(found.cov, float), error))
    assert 0.5 < np.mean(nees) < 4.3


def test_nothing_to_lay_changes_nothing(rng):
    true = pose()
    belief, walls, outlines = (
        believed(true, [0.005, 0.005, 0.01]),
        seen_from(true, corner(rng), rng),
        mapped(rng, corner),
    )
    none = replace(walls, good=jnp.zeros_like(walls.good))
    away = replace(walls, x=walls.x + 5.0)
    for prior, seen, kept in (
        (belief, none, outlines),
        (belief, walls, ours.no_outlines(SPEC)),
        (belief, away, outlines),
        (belief, replace(walls, x=walls.x * jnp.nan), outlines),
        (belief, replace(walls, variance=walls.variance * jnp.nan), outlines),
    ):
        found = matched(prior, seen, kept, spec=SPEC)
        for a, b in zip(jax.tree.leaves(found), jax.tree.leaves(prior), strict=True):
            np.testing.assert_array_equal(a, b)


def test_nasty_points_and_beliefs_stay_finite(rng):
    true = pose()
    walls = seen_from(true, corner(rng), rng, 0.003)
    x = np.array(walls.x)
    x[:5] = [np.nan, np.inf, -np.inf, 1e30, 0.0]
    outlines = added(ours.no_outlines(SPEC), replace(walls, x=jnp.asarray(x)), true, spec=SPEC)
    assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(outlines))
    same = jax.tree.map(lambda v: jnp.broadcast_to(v[:1], v.shape), walls)  # one point, as often as there is room
    for seen in (replace(walls, x=jnp.asarray(x)), same):
        for cov in (jnp.zeros((3, 3)), jnp.diag(jnp.asarray(SD**2, jnp.float32)), jnp.eye(3) * 1e6):
            kept = added(outlines, seen, true, spec=SPEC)
            found = matched(Belief(true, cov), seen, kept, spec=SPEC)
            assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(found))


def test_pictures_of_both_sensors():
    assert ours.picture_shape(64 * 48, 512, 384) == ((48, 64), 1)
    assert ours.picture_shape(256 * 192, 512, 384) == ((192, 256), 4)
    assert functools.reduce(lambda a, b: a * b, ours.picture_shape(128 * 96, 512, 384)[0]) == 128 * 96
