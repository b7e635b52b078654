"""`path_cost`: its gradient is that of Dijkstra's cost in float64, and at kinks a supergradient."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped import planning
from jaxbiped.mapping.grid import Cell
from tests.planning import oracle

H, W, B = 8, 9, 10
PAPER = np.array([1.0, 1.0, 5.0, 10.0, 100.0])
STEP = 1e-4  # of the finite differences, relative; far from all kinks of the maps below but those that are counted
ROUNDING = 1e-5  # of a float32 cost, relative


@pytest.fixture(scope="module")
def maps():
    rng = np.random.default_rng(5)
    classes, levels = oracle.random_grids(rng, B, H, W, blocked=0.15)
    start_ij, goal_ij = (np.stack([rng.integers(0, H, B), rng.integers(0, W, B)], -1) for _ in range(2))
    return classes, levels, start_ij, goal_ij


def reference(maps, b, costs):
    """The least cost of arena b in float64."""
    classes, levels, start_ij, goal_ij = (leaf[b] for leaf in maps)
    return oracle.cost_to_go(oracle.edge_costs(classes, levels, tuple(costs)), goal_ij)[tuple(start_ij)]


def cost_of(maps, **options):
    """`path_cost` as a function of a [..., 5] array."""
    classes, levels, start_ij, goal_ij = maps

    def cost(array):
        costs = planning.Costs(*jnp.moveaxis(array, -1, 0))
        return planning.path_cost(costs, classes, levels, start_ij=start_ij, goal_ij=goal_ij, **options)

    return cost


def gradients(maps, costs, **options):
    """Cost [B] and gradient [B, 5] at costs [B, 5]."""
    cost, back = jax.vjp(cost_of(maps, **options), jnp.asarray(costs, jnp.float32))
    return np.asarray(cost), np.asarray(back(jnp.ones_like(cost))[0])


def test_gradient_is_that_of_dijkstra_away_from_kinks(maps):
    rng = np.random.default_rng(6)
    smooth = kinks = 0
    for costs in PAPER * np.exp(rng.normal(0, 0.7, (2, B, 5))):
        cost, gradient = gradients(maps, costs)
        for b in range(B):
            least = reference(maps, b, costs[b])
            np.testing.assert_allclose(cost[b], least, rtol=ROUNDING)
            if not np.isfinite(least):
                assert not gradient[b].any()
                continue
            for k in range(5):
                step = STEP * costs[b, k] * (np.arange(5) == k)
                up, down = (reference(maps, b, costs[b] + sign * step) for sign in (1, -1))
                sides = np.array([up - least, least - down]) / step[k]
                if np.ptp(sides) > 1e-6:  # two paths cost the same here
                    kinks += 1
                else:
                    smooth += 1
                    np.testing.assert_allclose(gradient[b, k], sides.mean(), atol=1e-5)
    assert smooth > 50 and kinks < smooth / 20


def test_supergradient_everywhere_at_ties_too(maps):
    rng = np.random.default_rng(7)
    tied = np.ones(5)  # a level move costs what a step, a gate and the unknown cost
    cost, gradient = gradients(maps, np.tile(tied, (B, 1)))
    at_kinks = 0
    for other in tied * np.exp(rng.normal(0, 1, (6, 5))):
        for b in np.flatnonzero(np.isfinite(cost)):
            bound = cost[b] + gradient[b] @ (other - tied)
            assert reference(maps, b, other) <= bound + ROUNDING * (cost[b] + abs(bound))
    for b in np.flatnonzero(np.isfinite(cost)):
        for k in range(5):
            step = STEP * (np.arange(5) == k)
            down, least, up = (reference(maps, b, tied + sign * step) for sign in (-1, 0, 1))
            at_kinks += (least - down) - (up - least) > 0.1 * STEP
    assert at_kinks > 5


def test_scalar_costs_add_up_the_arenas_and_euler(maps):
    cost, each = gradients(maps, np.tile(PAPER, (B, 1)))
    whole = jax.grad(lambda c: jnp.sum(jnp.where(jnp.isfinite(x := cost_of(maps)(c)), x, 0.0)))(jnp.asarray(PAPER))
    np.testing.assert_allclose(whole, each.sum(0), rtol=1e-6)
    # a function that doubles when all costs double is its gradient times them
    np.testing.assert_allclose(each @ PAPER, np.where(np.isfinite(cost), cost, 0), rtol=ROUNDING)


def test_counts_of_a_path_by_hand():
    """Floor, gate, floor, up, down, unmeasured, in a row one cell wide; then a diagonal move."""
    row = [Cell.FLOOR, Cell.GATE, Cell.FLOOR, Cell.BUMP, Cell.FLOOR, Cell.FLOOR, Cell.UNMEASURED, Cell.FLOOR]
    classes = np.full((B, H, W), Cell.OBSTACLE, np.int8)
    classes[:, 0, :8], classes[:, 0, 8], classes[:, 1, 7:] = row, Cell.FLOOR, Cell.FLOOR
    levels = (classes == Cell.BUMP).astype(np.int8)
    start_ij, goal_ij = np.full((B, 2), [0, 0]), np.full((B, 2), [1, 8])
    paper = np.tile(PAPER, (B, 1))
    cost, gradient = gradients((classes, levels, start_ij, goal_ij), paper)
    np.testing.assert_allclose(gradient, np.tile([7 + np.sqrt(2), 2, 2, 2, 2], (B, 1)), rtol=1e-6)
    np.testing.assert_allclose(cost, gradient @ PAPER, rtol=ROUNDING)
    short, none = gradients((classes, levels, start_ij, goal_ij), paper, max_length=7)
    assert np.isinf(short).all() and not none.any()


def test_where_there_is_no_path(maps):
    classes, levels, start_ij, goal_ij = (leaf.copy() for leaf in maps)
    classes[:] = Cell.FLOOR
    levels[:], start_ij[:] = 0, [0, 0]
    goal_ij[::2], goal_ij[1::2] = [0, 0], [H, W]  # there already, and outside
    cost, gradient = gradients((classes, levels, start_ij, goal_ij), np.tile(PAPER, (B, 1)))
    assert not cost[::2].any() and np.isinf(cost[1::2]).all() and not gradient.any()


def test_under_jit_and_at_another_pitch(maps):
    classes, levels, start_ij, goal_ij = maps

    @jax.jit
    @jax.grad
    def slope(c1):
        costs = planning.Costs(c1=c1).at_pitch(0.025)
        cost = planning.path_cost(costs, classes, levels, start_ij=start_ij, goal_ij=goal_ij)
        return jnp.sum(jnp.where(jnp.isfinite(cost), cost, 0.0))

    halved = PAPER * [0.5, 0.5, 0.5, 1, 0.5]
    _, each = gradients(maps, np.tile(halved, (B, 1)))
    np.testing.assert_allclose(slope(1.0), each[:, 1].sum() / 2, rtol=1e-6)
