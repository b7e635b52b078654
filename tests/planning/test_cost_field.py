"""Edge costs and fields against plain loops and scipy's Dijkstra."""

import time
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from jaxbiped import planning
from jaxbiped.errors import InputError
from jaxbiped.mapping.grid import Cell
from jaxbiped.planning.kernels import solvers
from tests.planning import oracle

H, W, B = 9, 11, 150  # 150: more than one chunk, and not a multiple of it
SEEN = range(0, B, 6)  # arenas compared with the plain loops, which take most of the time
METHODS = ["line_sweep", "dijkstra", "wavefront"]
RELATIVE = 1e-5  # what the method promises against float64 Dijkstra


@pytest.fixture(scope="module")
def grids():
    rng = np.random.default_rng(0)
    classes, levels = oracle.random_grids(rng, B, H, W)
    goal_ij = np.stack([rng.integers(0, H, B), rng.integers(0, W, B)], -1)
    return classes, levels, goal_ij


def mixed(rng):
    """Costs and rules of their own for each arena, as a study mixes them on one batch axis."""
    costs = planning.Costs(*(rng.uniform(0, 20, B).astype(np.float32) for _ in range(5)))
    return costs, planning.Rules(*(rng.random(B) < 0.5 for _ in range(3)))


@pytest.mark.parametrize("method", METHODS)
def test_field_is_dijkstra(grids, method):
    classes, levels, goal_ij = grids
    costs, rules = mixed(np.random.default_rng(1))
    edges = planning.edge_costs(classes, levels, costs, rules)
    out = planning.field(classes, levels, costs, rules, goal_ij, method=method)
    assert out.converged.all()
    for b in SEEN:
        args = [float(c[b]) for c in jax.tree.leaves(costs)], *(bool(r[b]) for r in jax.tree.leaves(rules))
        by_loops = oracle.edge_costs(classes[b], levels[b], *args)
        np.testing.assert_allclose(edges[b], by_loops, rtol=1e-6)
        np.testing.assert_allclose(out.cost[b], oracle.cost_to_go(by_loops, goal_ij[b]), rtol=RELATIVE)


@pytest.mark.parametrize("method", METHODS)
def test_any_edge_costs(method):
    """One-way moves, free ones, forbidden ones: nothing that a class grid could give."""
    rng = np.random.default_rng(2)
    edges = rng.uniform(0, 5, (20, 8, H, W)).astype(np.float32)
    edges[rng.random(edges.shape) < 0.2] = 0
    edges[rng.random(edges.shape) < 0.5] = np.inf
    goal_ij = np.stack([rng.integers(0, H, 20), rng.integers(0, W, 20)], -1)
    out = planning.cost_to_go(edges, goal_ij, method=method)
    for b in range(20):
        np.testing.assert_allclose(out.cost[b], oracle.cost_to_go(edges[b], goal_ij[b]), rtol=RELATIVE)


def test_an_arena_does_not_depend_on_its_batch(grids):
    classes, levels, goal_ij = grids
    costs, rules = mixed(np.random.default_rng(4))
    whole = planning.field(classes, levels, costs, rules, goal_ij)
    for part in (slice(0, 1), slice(3, 40), slice(140, 150)):
        mine = jax.tree.map(lambda a, p=part: a[p], (costs, rules))
        alone = planning.field(classes[part], levels[part], *mine, goal_ij[part])
        jax.tree.map(np.testing.assert_array_equal, alone, jax.tree.map(lambda a, p=part: a[p], whole))


def test_sixty_four_costs_compile_once(grids):
    classes, levels, goal_ij = (a[:20] for a in grids)
    traces = 0

    @jax.jit
    def run(costs):
        nonlocal traces
        traces += 1
        return planning.field(classes, levels, costs, planning.Rules(), goal_ij).cost

    rng = np.random.default_rng(5)
    for _ in range(64):
        run(planning.Costs(*(float(c) for c in rng.uniform(0, 10, 5))))
    assert traces == 1


def test_inside_a_compiled_loop(grids):
    classes, levels, goal_ij = (jnp.asarray(a[:20]) for a in grids)

    @jax.jit
    def loop(goal_ij):
        def body(state):
            total, n = state
            return total + planning.field(classes, levels, goal_ij=goal_ij).cost, n + 1

        return lax.while_loop(lambda s: s[1] < 2, body, (jnp.zeros((20, H, W)), 0))[0]

    np.testing.assert_allclose(loop(goal_ij), 2 * planning.field(classes, levels, goal_ij=goal_ij).cost, rtol=1e-6)


@pytest.mark.parametrize("bad", [np.nan, -1.0])
def test_bad_costs_are_named_not_looped_over(grids, bad):
    classes, levels, goal_ij = (a[:20] for a in grids)
    c1 = np.ones(20, np.float32)
    c1[3] = bad
    out = planning.field(classes, levels, planning.Costs(c1=c1), planning.Rules(), goal_ij)
    assert np.flatnonzero(~np.asarray(out.converged)).tolist() == [3]
    assert np.isinf(out.cost[3]).all()
    edges = np.array(planning.edge_costs(classes, levels))
    edges[5, 2, 4, 4] = bad
    out = planning.cost_to_go(edges, goal_ij)
    assert np.flatnonzero(~np.asarray(out.converged)).tolist() == [5]
    assert np.isinf(out.cost[5]).all()


def test_nasty_grids():
    one = planning.field(np.ones((1, 1, 1), np.int8), np.zeros((1, 1, 1), np.int8), goal_ij=np.zeros((1, 2), int))
    assert one.cost.tolist() == [[[0.0]]] and one.converged.all()
    full = np.full((3, 4, 5), Cell.OBSTACLE, np.int8)
    goal_ij = np.array([[1, 1], [-1, 0], [0, 5]])
    out = planning.field(full, 0 * full, goal_ij=goal_ij)
    assert out.converged.all() and np.isfinite(out.cost).sum() == 1 and out.cost[0, 1, 1] == 0
    row = planning.field(np.ones((1, 1, 9), np.int8), np.zeros((1, 1, 9), np.int8), goal_ij=np.array([[0, 8]]))
    np.testing.assert_allclose(row.cost[0, 0], 2.0 * np.arange(8, -1, -1))


def test_no_arenas():
    none = np.zeros((0, 4, 5), np.int8)
    out = planning.field(none, none, goal_ij=np.zeros((0, 2), int))
    assert out.cost.shape == (0, 4, 5) and out.converged.shape == (0,)


def test_unknown_method():
    free = np.ones((1, 2, 2), np.int8)
    with pytest.raises(InputError, match="line_sweep"):
        planning.field(free, 0 * free, goal_ij=np.zeros((1, 2), int), method="dial")


def serpentine(height, width):
    """Passable cells of the longest corridor that a grid holds."""
    passable = np.zeros((height, width), bool)
    passable[::2] = True
    for i in range(1, height, 2):
        passable[i, -1 if i % 4 == 1 else 0] = True
    return passable


@pytest.mark.parametrize("shape", [(28, 36), (61, 73)])
def test_long_sums_do_not_drift(shape):
    """The longest path of each grid, at costs that float32 cannot hold: the worst case for rounding."""
    rng = np.random.default_rng(6)
    passable = serpentine(*shape)
    classes = np.where(passable, Cell.FLOOR, Cell.OBSTACLE).astype(np.int8)[None].repeat(8, 0)
    costs = planning.Costs(c0=rng.uniform(0.1, 3, 8).astype(np.float32), c1=rng.uniform(0.1, 3, 8).astype(np.float32))
    out = planning.field(classes, 0 * classes, costs, planning.Rules(), np.zeros((8, 2), int))
    edges = np.asarray(planning.edge_costs(classes, 0 * classes, costs, planning.Rules()))
    for b in range(8):
        np.testing.assert_allclose(out.cost[b], oracle.cost_to_go(edges[b], (0, 0)), rtol=RELATIVE)


@pytest.mark.parametrize("size", [101, pytest.param(1024, marks=pytest.mark.slow)])
def test_mazes(size):
    passable = oracle.maze(np.random.default_rng(size), size, size, loops=size)
    classes = np.where(passable, Cell.FLOOR, Cell.OBSTACLE).astype(np.int8)[None]
    goal_ij = np.zeros((1, 2), int)
    out = planning.field(classes, 0 * classes, goal_ij=goal_ij)
    edges = np.asarray(planning.edge_costs(classes, 0 * classes))[0]
    np.testing.assert_allclose(out.cost[0], oracle.cost_to_go(edges, goal_ij[0]), rtol=RELATIVE)


def test_few_and_many_large_maps_agree():
    """One large map of single cells thrown at random, with one-way and free moves: no order of rows fits it."""
    rng = np.random.default_rng(8)
    edges = rng.uniform(0, 5, (2, 8, 40, 50)).astype(np.float32)
    edges[rng.random(edges.shape) < 0.1] = 0
    edges[rng.random(edges.shape) < 0.5] = np.inf
    goal_ij = np.array([[3, 4], [20, 48]])
    out = planning.cost_to_go(edges, goal_ij, method="dijkstra")
    assert out.converged.all()
    for b in range(2):
        np.testing.assert_allclose(out.cost[b], oracle.cost_to_go(edges[b], goal_ij[b]), rtol=RELATIVE)
    # a batch of many goes another way, to the same numbers
    many = planning.cost_to_go(edges[[0] * 20], goal_ij[[0] * 20], method="line_sweep")
    np.testing.assert_array_equal(many.cost[7], out.cost[0])


def test_threads_that_begin_together_compile_a_kernel_once(monkeypatch):
    """Each would register its own under the same name, and the one that XLA calls might be thrown away."""
    calls = []

    @cache
    def slow(method):
        calls.append(method)
        time.sleep(0.1)
        return method, 1

    monkeypatch.setattr(solvers, "registered", slow)
    with ThreadPoolExecutor(4) as pool:
        found = set(pool.map(lambda _: solvers.target("line_sweep"), range(4)))
    assert found == {("line_sweep", 1)} and calls == ["line_sweep"]
