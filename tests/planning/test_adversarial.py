"""Every planner against scipy's Dijkstra on maps of nasty structure: 22,000 of them and as many sets of edges.

Tolerances. RELATIVE: what the planner promises against float64 Dijkstra, on every input; sums are float64, results
float32, so that 1e-7 is what is seen. A path that is read off a field may at each move lose `TIE` of what is left by
its rule for ties, so that its own sum is within `TIE` times its length.
"""

import jax
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from jaxbiped import planning
from jaxbiped.planning.kernels import LANES
from jaxbiped.planning.path import TIE
from tests.planning import adversarial, oracle

SHAPES = ((1, 9), (9, 1), (5, 7), (12, 9))
COUNT = 5500  # maps of each shape
METHODS = ("line_sweep", "dijkstra", "wavefront")
RELATIVE = 1e-5
YAW = 1e-6  # of 45 degrees: what a float32 of radians, up to pi, may be off, with its sum and its remainder
SOME = 40  # maps compared with plain Python


def problem(shape, count, seed=0):
    rng = np.random.default_rng([seed, *shape])
    classes, levels, goal_ij = adversarial.maps(rng, shape, count)
    return classes, levels, *adversarial.costs(rng, count), goal_ij


def path_sums(path, edges):
    """What each path costs by its own moves, float64."""
    directions, ij = np.asarray(path.directions), np.asarray(path.cells_ij)[:, :-1]
    moves, arena = directions >= 0, np.arange(len(directions))[:, None]
    i, j = (np.where(moves, ij[..., axis], 0) for axis in (0, 1))
    return np.where(moves, np.asarray(edges, np.float64)[arena, np.maximum(directions, 0), i, j], 0).sum(1)


@pytest.mark.parametrize("shape", SHAPES)
def test_every_field_is_dijkstra_and_every_path_costs_what_it_says(shape):
    classes, levels, costs, rules, goal_ij = problem(shape, COUNT)
    edges = np.asarray(planning.edge_costs(classes, levels, costs, rules))
    wanted = adversarial.cost_to_go(edges, goal_ij)
    for method in METHODS:
        out = planning.field(classes, levels, costs, rules, goal_ij, method=method)
        assert out.converged.all()
        np.testing.assert_allclose(out.cost, wanted, rtol=RELATIVE, err_msg=method)
    rng = np.random.default_rng(1)
    start_ij = np.stack([rng.integers(0, n, COUNT) for n in shape], -1)
    heading = rng.integers(-1, 8, COUNT)
    length = shape[0] * shape[1]
    field = planning.field(classes, levels, costs, rules, goal_ij)
    path = planning.read_path(field, edges, start_ij, length, heading)
    there = np.asarray(field.cost)[np.arange(COUNT), start_ij[:, 0], start_ij[:, 1]]
    np.testing.assert_array_equal(path.valid, np.isfinite(there))
    sums, reached = path_sums(path, edges), np.isfinite(there)
    np.testing.assert_allclose(sums[reached], there[reached], rtol=RELATIVE + TIE * length, atol=1e-30)
    first = np.asarray(planning.next_step(field.cost, classes, levels, costs, rules, start_ij, heading, length=1))[:, 0]
    found = first >= 0
    np.testing.assert_array_equal(first[found], np.asarray(path.directions)[found, 0])
    assert not (found & ~reached).any()
    best = planning.path_cost(costs, classes, levels, rules, start_ij=start_ij, goal_ij=goal_ij, heading=heading)
    np.testing.assert_array_equal(best, there)
    counts = planning.move_counts(path, classes, levels, rules).per_cost()
    paid = sum(
        np.asarray(n, float) * np.asarray(c, float) for n, c in zip(*map(jax.tree.leaves, (counts, costs)), strict=True)
    )
    np.testing.assert_allclose(paid[reached], sums[reached], rtol=RELATIVE, atol=1e-30)
    for b in range(SOME):
        args = [float(c[b]) for c in jax.tree.leaves(costs)], *(bool(r[b]) for r in jax.tree.leaves(rules))
        np.testing.assert_allclose(edges[b], oracle.edge_costs(classes[b], levels[b], *args), rtol=1e-6)
        found = planning.astar(edges[b], start_ij[b], goal_ij[b], int(heading[b]))
        np.testing.assert_allclose(found.cost, there[b], rtol=RELATIVE)


@pytest.mark.parametrize("shape", SHAPES)
def test_any_edges_that_no_class_grid_gives(shape):
    rng = np.random.default_rng([2, *shape])
    edges = adversarial.edges(rng, shape, COUNT)
    goal_ij = np.stack([rng.integers(0, n, COUNT) for n in shape], -1)
    goal_ij[::3] = np.array(shape) - 1  # the end of the one way through all cells
    wanted = adversarial.cost_to_go(edges, goal_ij)
    for method in METHODS:
        out = planning.cost_to_go(edges, goal_ij, method=method)
        assert out.converged.all()
        np.testing.assert_allclose(out.cost, wanted, rtol=RELATIVE, err_msg=method)
    start_ij = np.zeros((COUNT, 2), int)
    path = planning.read_path(planning.cost_to_go(edges, goal_ij), edges, start_ij, shape[0] * shape[1])
    there = wanted[:, 0, 0]
    # a plateau of moves that cost nothing is left for nothing: such a path may end beside its goal
    np.testing.assert_array_equal(path.valid, np.isfinite(there))
    reached = np.isfinite(there)
    tolerance = RELATIVE + TIE * shape[0] * shape[1]
    np.testing.assert_allclose(path_sums(path, edges)[reached], there[reached], rtol=tolerance, atol=1e-30)


@pytest.mark.parametrize("shape", SHAPES[1:3])
def test_every_field_over_headings_is_dijkstra(shape):
    count = 400
    classes, levels, _, rules, goal_ij = problem(shape, count, 3)
    rng = np.random.default_rng(3)
    times = planning.Times(*(10 ** rng.uniform(-2, 4, (7, count))).astype(np.float32))
    for method in METHODS:
        out = planning.heading_field(classes, levels, times, rules, goal_ij, method=method)
        assert out.converged.all()
        wanted = adversarial.time_to_go(out.moves.time, out.moves.face, out.turn, goal_ij)
        np.testing.assert_allclose(out.cost, wanted, rtol=RELATIVE, err_msg=method)
    start_ij = np.stack([rng.integers(0, n, count) for n in shape], -1)
    yaw = (rng.integers(0, 8, count) * np.pi / 4).astype(np.float32)
    path = planning.heading_path(out, start_ij, yaw, shape[0] * shape[1])
    taken = planning.path_time(out.moves, out.turn, path, yaw)
    reached, length = np.asarray(path.valid), shape[0] * shape[1]
    off = np.abs(np.asarray(taken, float) - np.asarray(path.cost, float))[reached]
    share = (RELATIVE + TIE * length) * np.asarray(path.cost)[reached]
    assert (off <= share + YAW * length * times.turn[reached]).all()


@pytest.mark.parametrize("batch", [1, LANES - 1, LANES, 31, 32, 33, 64])
@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize=True)
@given(data=st.data())
def test_batches_of_any_size_and_copies_of_one_map(batch, data):
    classes, levels, costs, rules, goal_ij = data.draw(adversarial.problems((5, 7), batch))
    edges = np.asarray(planning.edge_costs(classes, levels, costs, rules))
    wanted = adversarial.cost_to_go(edges, goal_ij)
    fields = [planning.field(classes, levels, costs, rules, goal_ij)]
    if batch in (1, 33):  # which compile another program each
        fields += [planning.cost_to_go(edges, goal_ij), planning.cost_to_go(edges, goal_ij, method="wavefront")]
    for out in fields:
        assert out.converged.all()
        np.testing.assert_allclose(out.cost, wanted, rtol=RELATIVE)


def test_a_corridor_below_a_room_in_copies_of_one_map():
    """A floor of 14 rows, below it a corridor one cell wide with the goal in it: nothing is beside the goal."""
    classes = np.full((28, 36), 4, np.int8)
    classes[:14], classes[14:, 18] = 1, 1
    levels = np.zeros_like(classes)
    strip = np.ones((3, 1), np.int8)
    for copies in (1, 32, 64):
        out = planning.field(np.repeat(classes[None], copies, 0), levels, goal_ij=[27, 18])
        assert (np.isfinite(out.cost).sum((1, 2)) == 14 * 36 + 14).all() and out.converged.all()
        alone = planning.cost_to_go(planning.edge_costs(np.repeat(strip[None], copies, 0), 0 * strip), [2, 0])
        assert (alone.cost[..., 0] == np.array([4.0, 2.0, 0.0])).all() and alone.converged.all()


def test_long_ways_one_way_through_all_cells_do_not_drift():
    """1,188 moves of the same cost: as float32 sums would be 1.8e-5 off."""
    shape = (33, 36)
    rng = np.random.default_rng(4)
    edges = np.concatenate([adversarial.edges(rng, shape, 40) for _ in range(2)])
    goal_ij = np.repeat([[32, 35]], len(edges), 0)
    out = planning.cost_to_go(edges, goal_ij)
    assert out.converged.all()
    np.testing.assert_allclose(out.cost, adversarial.cost_to_go(edges, goal_ij), rtol=RELATIVE)
