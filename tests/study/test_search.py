"""The gradient of perturbed objectives against closed forms and finite differences; points over a box."""

import numpy as np
import pytest
from scipy import stats

from jaxbiped import planning
from jaxbiped.study.search import directions, gradient, sobol
from tests.planning import oracle

FOUR_SIGMA = 4.0  # standard errors: a test that fails by chance once in 16,000


def test_directions_are_square_to_each_other_and_uniform():
    rng = np.random.default_rng(0)
    drawn = np.array([directions(rng, 6, 4) for _ in range(4000)])
    assert drawn.shape == (4000, 6, 4)
    products = drawn @ np.swapaxes(drawn, 1, 2)
    np.testing.assert_allclose(products[:, :4, :4], np.broadcast_to(np.eye(4), (4000, 4, 4)), atol=1e-12)
    np.testing.assert_allclose(products[:, 4:, 4:], np.broadcast_to(np.eye(2), (4000, 2, 2)), atol=1e-12)
    for row in (0, 5):
        for k in range(4):  # (x + 1) / 2 of a point on the sphere of four dimensions
            assert stats.kstest((drawn[:, row, k] + 1) / 2, stats.beta(1.5, 1.5).cdf).pvalue > 1e-3
    np.testing.assert_array_equal(*(directions(np.random.default_rng(3), 4, 4) for _ in range(2)))


def test_exact_where_the_objective_is_linear():
    rng, slope = np.random.default_rng(4), np.array([3.0, -1.0, 0.0, 20.0])
    for pairs in (4, 8):
        along = directions(rng, pairs, 4)
        np.testing.assert_allclose(gradient(7 + along @ slope, 7 - along @ slope, along, 1.0), slope, atol=1e-12)


def test_gradient_of_a_jump_in_closed_form():
    """Its mean over a disc is the share of the disc beyond it, though the jump itself has no gradient anywhere."""
    rng, radius, place, edge = np.random.default_rng(1), 0.7, np.array([0.2, -0.4]), np.array([0.5, 0.1])

    def objective(x):
        return np.sum(x > edge, axis=-1).astype(float)

    along = [directions(rng, 2, 2) for _ in range(20000)]
    found = np.array([gradient(objective(place + radius * u), objective(place - radius * u), u, radius) for u in along])
    wanted = 2 / (np.pi * radius) * np.sqrt(1 - ((place - edge) / radius) ** 2)  # the chord over the disc's area
    error = found.std(0) / np.sqrt(len(found))
    assert np.all(np.abs(found.mean(0) - wanted) < FOUR_SIGMA * error) and np.all(error < 0.02 * wanted)


@pytest.mark.parametrize("pairs", [1, 4])
def test_gradient_of_planned_times_is_that_of_finite_differences(pairs):
    """The time of planned paths, a function of the path: flat, with jumps. Its mean over a ball is smooth."""
    rng, radius, count, maps = np.random.default_rng(2), 1.5, 256, 16
    classes, levels = oracle.random_grids(rng, maps, 7, 8, blocked=0.1)
    levels = np.minimum(levels, 1)
    ends = np.tile([[0, 0]], (maps, 1)), np.tile([[6, 7]], (maps, 1))
    classes[:, 0, 0] = classes[:, 6, 7] = 1
    place = np.log([1.0, 3.0, 4.0, 6.0])
    repeated = np.tile(classes, (count, 1, 1)), np.tile(levels, (count, 1, 1))
    ends = tuple(np.tile(end, (count, 1)) for end in ends)

    def objective(places):
        """Mean seconds over the maps of each place, at 16, 48, 96 and 40 s a move."""
        columns = np.repeat(np.exp(places), maps, axis=0).T.astype(np.float32)
        costs = planning.Costs(np.ones(count * maps, np.float32), *columns)
        to_go = planning.field(*repeated, costs, planning.Rules(), ends[1])
        path = planning.read_path(to_go, planning.edge_costs(*repeated, costs), ends[0], 30)
        moves = planning.move_counts(path, *repeated)
        seconds = 16 * moves.level + 48 * moves.gate + 96 * moves.step + 40 * moves.unmeasured
        return np.asarray(seconds, float).reshape(count, maps).mean(1)

    along = np.concatenate([directions(rng, pairs, 4) for _ in range(count // pairs)])
    plus, minus = objective(place + radius * along), objective(place - radius * along)
    found = np.array(
        [gradient(*(part[k : k + pairs] for part in (plus, minus, along)), radius) for k in range(0, count, pairs)]
    )
    # wide differences of the mean over the ball, on the same points of it: their bias is of third order
    step, inside = 0.4, sobol(count, 0.0, 1.0, 5, 7).clip(1e-6, 1 - 1e-6)
    ball = stats.norm.ppf(inside[:, :4])
    ball *= inside[:, 4:] ** 0.25 / np.linalg.norm(ball, axis=1, keepdims=True)
    error = found.std(0) / np.sqrt(len(found))
    for k, axis in enumerate(np.eye(4)):
        sides = [objective(place + sign * step * axis + radius * ball) for sign in (1, -1)]
        difference = (sides[0] - sides[1]) / (2 * step)
        both = np.hypot(error[k], difference.std() / np.sqrt(count))
        assert abs(found.mean(0)[k] - difference.mean()) < FOUR_SIGMA * both, k
    assert np.abs(found.mean(0)).max() > FOUR_SIGMA * error.max()  # there is something to find


def test_sobol_points_fill_the_box():
    points = sobol(64, -1.0, 3.0, 4, seed=5)
    assert points.shape == (64, 4) and points.min() >= -1 and points.max() <= 3
    for column in points.T:  # balanced: one in each of 64 slices
        assert len(set(np.floor((column + 1) / 4 * 64).astype(int))) == 64
    np.testing.assert_array_equal(sobol(10, -1.0, 3.0, 4, seed=5), points[:10])
    assert sobol(0, 0.0, 1.0, 4, 0).shape == (0, 4) and sobol(1, 0.0, 1.0, 4, 0).shape == (1, 4)
