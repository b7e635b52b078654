"""Reading paths: `read_path`, `next_step` and `astar` walk the same cells, and their cost is the field's."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped import planning
from jaxbiped.mapping.grid import Cell
from tests.planning import oracle

H, W, B, LENGTH = 13, 17, 24, 40
RELATIVE = 1e-5


@pytest.fixture(scope="module")
def planned():
    rng = np.random.default_rng(3)
    classes, levels = oracle.random_grids(rng, B, H, W, blocked=0.12)
    goal_ij, start_ij = (np.stack([rng.integers(0, H, B), rng.integers(0, W, B)], -1) for _ in range(2))
    edges = planning.edge_costs(classes, levels)
    field = planning.field(classes, levels, goal_ij=goal_ij)
    heading = rng.integers(-1, 8, B)
    return classes, levels, start_ij, goal_ij, edges, field, heading


def test_three_readers_walk_the_same_cells(planned):
    classes, levels, start_ij, goal_ij, edges, field, heading = planned
    path = planning.read_path(field, edges, start_ij, LENGTH, heading)
    first = planning.next_step(
        field.cost, classes, levels, planning.Costs(), planning.Rules(), start_ij, heading, length=LENGTH
    )
    np.testing.assert_array_equal(first, path.directions)
    found = 0
    for b in range(B):
        reference = planning.astar(edges[b], start_ij[b], goal_ij[b], int(heading[b]))
        np.testing.assert_allclose(path.cost[b], reference.cost, rtol=RELATIVE)
        assert bool(path.valid[b]) == np.isfinite(reference.cost)
        if path.valid[b]:
            found += 1
            np.testing.assert_array_equal(path.cells_ij[b, : int(path.length[b]) + 1], reference.cells_ij)
    assert found > B // 3


def test_path_costs_what_the_field_says(planned):
    _, _, _, _, edges, field, _ = planned
    path = planning.read_path(field, edges, planned[2], LENGTH)
    for b in np.flatnonzero(path.valid):
        cells, moves = np.asarray(path.cells_ij[b]), np.asarray(path.directions[b])
        total = sum(edges[b, moves[n], *cells[n]] for n in range(int(path.length[b])))
        np.testing.assert_allclose(total, path.cost[b], rtol=RELATIVE)


def test_ties_keep_the_heading_then_the_order_of_directions():
    free = np.full((3, 7, 7), Cell.FLOOR, np.int8)
    goal_ij, start_ij = np.full((3, 2), [6, 3]), np.full((3, 2), [0, 1])  # two diagonal moves among six
    heading = np.array([2, 1, -1])
    edges = planning.edge_costs(free, 0 * free)
    field = planning.field(free, 0 * free, goal_ij=goal_ij)
    moves = np.asarray(planning.read_path(field, edges, start_ij, 6, heading).directions)
    assert moves.tolist() == [[2, 2, 2, 2, 1, 1], [1, 1, 2, 2, 2, 2], [1, 1, 2, 2, 2, 2]]


def test_no_way_and_outside():
    classes = np.full((3, 5, 5), Cell.FLOOR, np.int8)
    classes[0, 2] = Cell.OBSTACLE
    start_ij, goal_ij = np.array([[0, 0], [7, 0], [4, 4]]), np.array([[4, 4]] * 3)
    edges = planning.edge_costs(classes, 0 * classes)
    field = planning.field(classes, 0 * classes, goal_ij=goal_ij)
    path = planning.read_path(field, edges, start_ij, 6)
    assert path.valid.tolist() == [False, False, True]
    assert path.length.tolist() == [0, 0, 0]
    assert planning.astar(edges[0], start_ij[0], goal_ij[0]).cost == np.inf
    assert planning.astar(edges[1], start_ij[1], goal_ij[1]).cells_ij.shape == (0, 2)
    assert planning.astar(edges[2], start_ij[2], goal_ij[2]).cost == 0


def test_moves_that_cost_nothing_do_not_lead_in_circles():
    """A corridor in which all but the last move are free: one plateau that only counting moves can cross."""
    edges = np.full((1, 8, 1, 12), np.inf, np.float32)
    edges[0, 0], edges[0, 4] = 0.0, 0.0
    edges[0, 0, 0, -1] = edges[0, 4, 0, 0] = np.inf
    edges[0, 0, 0, -2] = 3.0
    field = planning.cost_to_go(edges, np.array([[0, 11]]))
    path = planning.read_path(field, edges, np.array([[0, 2]]), 12)
    assert bool(path.valid[0]) and int(path.length[0]) == 9
    assert len(planning.astar(edges[0], (0, 2), (0, 11)).cells_ij) == 10


def test_costs_are_per_metre_and_per_event():
    """The same way, straight over one bump, on 5 cm and on 2.5 cm cells: equal but for one cell at each edge."""

    def way(pitch, bump):
        cells = round(2.0 / pitch)
        classes = np.full((1, 1, cells + 1), Cell.FLOOR, np.int8)
        if bump:
            classes[:, :, round(0.9 / pitch) : round(1.1 / pitch)] = Cell.BUMP
        levels = (classes == Cell.BUMP).astype(np.int8)
        costs = planning.Costs().at_pitch(pitch)
        out = planning.field(classes, levels, costs, planning.Rules(), np.array([[0, cells]]))
        return float(out.cost[0, 0, 0])

    cell = 2.0  # C0 + C1 on 5 cm
    np.testing.assert_allclose(way(0.025, False), way(0.05, False), rtol=RELATIVE)
    np.testing.assert_allclose(way(0.05, False), 40 * cell, rtol=RELATIVE)
    assert abs(way(0.025, True) - way(0.05, True)) <= cell
    assert way(0.05, True) > 2 * 10 + 38


def test_next_step_takes_costs_per_arena(planned):
    classes, levels, start_ij, goal_ij, _, _, heading = planned
    c3 = jnp.linspace(1.0, 200.0, B)
    costs, rules = planning.Costs(c3=c3), planning.Rules(gates=jnp.arange(B) % 2 == 0)
    field = planning.field(classes, levels, costs, rules, goal_ij)
    edges = planning.edge_costs(classes, levels, costs, rules)
    path = planning.read_path(field, edges, start_ij, 3, heading)
    first = planning.next_step(field.cost, classes, levels, costs, rules, start_ij, heading, length=3)
    np.testing.assert_array_equal(first, path.directions)
