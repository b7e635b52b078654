"""Ways that functions of people return: read and priced as Eq. 1 says, or refused with what is wrong with them."""

import pickle
import subprocess
import sys
from pathlib import Path

import jax
import numpy as np
import pytest

from jaxbiped.errors import InputError
from jaxbiped.mapping.grid import Cell
from jaxbiped.planning import DIRECTIONS, Costs, Rules
from jaxbiped.planning.host_planner import HostPlanner, passable
from jaxbiped.planning.path_check import PathQuery, check_path, check_paths
from tests.reference import planning as reference

ROOT = Path(__file__).parents[2]

COSTS = Costs()
FLAT = np.zeros((3, 4), np.int8)
OPEN = np.full((3, 4), Cell.FLOOR, np.int8)
WALL = OPEN.copy()
WALL[1, 1] = Cell.OBSTACLE
STEEP = FLAT.copy()
STEEP[:, 2] = 2


@pytest.mark.parametrize(
    "way, grid, levels, match",
    [
        ([], OPEN, FLAT, "must return cells"),
        (5, OPEN, FLAT, "must return cells"),
        ([[0, 0, 0], [1, 0, 0]], OPEN, FLAT, "must return cells"),
        ("up", OPEN, FLAT, "must return cells"),
        ([[0.5, 0], [0, 3]], OPEN, FLAT, "whole rows and columns"),
        ([[np.nan, 0], [0, 3]], OPEN, FLAT, "whole rows and columns"),
        ([[0, 1], [0, 2], [0, 3]], OPEN, FLAT, r"goes from \[0, 1\] to \[0, 3\], not from \[0, 0\]"),
        ([[0, 0], [0, 1], [0, 2]], OPEN, FLAT, "goes from"),
        ([[0, 0], [-1, 1], [-1, 2], [0, 3]], OPEN, FLAT, "leaves the map"),
        ([[0, 0], [0, 1], [0, 4], [0, 3]], OPEN, FLAT, "leaves the map"),
        ([[0, 0], [0, 2], [0, 3]], OPEN, FLAT, "do not neighbour"),
        ([[0, 0], [0, 0], [0, 1], [0, 2], [0, 3]], OPEN, FLAT, "do not neighbour"),
        ([[0, 0], [1, 1], [0, 2], [0, 3]], WALL, FLAT, r"obstacle at \[1, 1\]"),
        ([[0, 0], [0, 1], [1, 2], [0, 3]], WALL, FLAT, "cuts the corner"),
        ([[0, 0], [0, 1], [0, 2], [0, 3]], OPEN, STEEP, "up or down 2 levels"),
    ],
)
def test_ways_that_are_wrong_are_refused_by_what_is_wrong(way, grid, levels, match):
    with pytest.raises(ValueError, match=match):
        check_path(way, PathQuery(grid, levels, (0, 0), (0, 3), COSTS, False))


def test_corners_may_be_cut_where_the_rules_allow_it():
    moves, cost = check_path([[0, 0], [0, 1], [1, 2], [0, 3]], PathQuery(WALL, FLAT, (0, 0), (0, 3), COSTS, True))
    assert moves.tolist() == [0, 1, 7] and cost == pytest.approx(2 + 2 * (np.sqrt(2) + 1))


def test_random_walks_cost_what_the_plain_edges_cost_and_are_refused_where_these_are_forbidden():
    """Thousands of walks of one to four moves on maps of all classes and levels, with and without cut corners."""
    rng, refused, read = np.random.default_rng(0), 0, 0
    for _ in range(300):
        shape = tuple(rng.integers(1, 7, 2))
        classes, levels = rng.integers(0, 5, shape).astype(np.int8), rng.integers(-1, 3, shape).astype(np.int8)
        rules = Rules(*(bool(v) for v in rng.integers(0, 2, 3)))
        costs = Costs(*rng.uniform(0.1, 20, 5).tolist())
        edges = reference.edge_costs(classes, levels, costs, rules)
        grid = passable(classes[None], np.array([[rules.corner_cutting, rules.bumps, rules.gates]]))[0]
        for _ in range(20):
            moves = rng.integers(0, 8, rng.integers(1, 5))
            cells = np.vstack([[rng.integers(0, n) for n in shape], DIRECTIONS[moves]]).cumsum(0)
            inside = ((cells >= 0) & (cells < shape)).all()
            price = (
                sum(edges[k, i + 1, j + 1] for k, (i, j) in zip(moves, cells[:-1], strict=True)) if inside else np.inf
            )
            try:
                given = check_path(cells, PathQuery(grid, levels, cells[0], cells[-1], costs, rules.corner_cutting))
            except ValueError:
                refused += 1
                assert price == np.inf
            else:
                read += 1
                np.testing.assert_array_equal(given[0], moves)
                assert given[1] == pytest.approx(price, rel=1e-12)
    assert refused > 2000 and read > 200


NASTY = (
    None, [], [[]], [0, 0], "nonsense", [[0.5, 0.0]], [[np.nan, 0.0]], [[1e300, 0.0]], [[2**62, 0], [0, 0]], [[-1, -1]],
    [[0, 0]], [[0, 0], [0, 0]], [[0, 0], [0, 2]], [(0, 0), (9, 9)], np.zeros((3, 2), np.uint8), np.zeros((0, 2)),
    [[1, 2, 3]],
)  # fmt: skip


def test_a_batch_of_ways_is_read_as_one_by_one():
    """Of walks and of nonsense, on maps of all classes and levels: the same moves, costs and complaints."""
    rng, seen = np.random.default_rng(1), set()
    for _ in range(60):
        count, shape = rng.integers(1, 40), tuple(rng.integers(1, 6, 2))
        classes = rng.choice(5, (count, *shape), p=(0.1, 0.5, 0.15, 0.15, 0.1)).astype(np.int8)
        levels = rng.choice(3, (count, *shape), p=(0.8, 0.15, 0.05)).astype(np.int8)
        costs, cutting = rng.uniform(0.1, 20, (count, 5)).astype(np.float32), rng.random(count) < 0.5
        start, goal, ways = np.zeros((count, 2), np.int32), np.zeros((count, 2), np.int32), []
        for k in range(count):
            cells = np.vstack([[rng.integers(0, n) for n in shape], DIRECTIONS[rng.integers(0, 8, rng.integers(0, 5))]])
            cells = cells.cumsum(0)
            start[k], goal[k] = cells[0], cells[-1]
            if rng.random() < 0.1:
                goal[k] += 1
            ways.append(NASTY[rng.integers(len(NASTY))] if rng.random() < 0.3 else cells.tolist())
        moves, cost, wrong = check_paths(ways, PathQuery(classes, levels, start, goal, costs, cutting), 3)
        for k, way in enumerate(ways):
            expected, price, complaint = [-1, -1, -1], np.nan, None
            try:
                if way is not None:
                    own = Costs(*costs[k].tolist())
                    ends = start[k], goal[k]
                    found, price = check_path(way, PathQuery(classes[k], levels[k], *ends, own, bool(cutting[k])))
                    expected[: min(3, len(found))] = found[:3]
            except Exception as error:
                complaint = str(error)
            assert moves[k].tolist() == expected and wrong.get(k) == complaint, (way, complaint)
            np.testing.assert_array_equal(cost[k], np.float32(price))
            seen.add(complaint and complaint[:20])
    assert len(seen) > 8


def test_no_way_to_go_is_a_way():
    moves, cost = check_path([[1, 0]], PathQuery(WALL, FLAT, (1, 0), (1, 0), COSTS, False))
    assert len(moves) == 0 and cost == 0


def test_cells_that_must_not_be_crossed_are_obstacles():
    grid = np.array([[Cell.FLOOR, Cell.BUMP, Cell.GATE, Cell.UNMEASURED]], np.int8)
    rules = np.array([[False, True, True], [False, False, True], [True, True, False]])
    all_of_it, no_bumps, no_gates = passable(np.stack([grid] * 3), rules)
    assert (all_of_it == grid).all()
    assert no_bumps.tolist() == [[Cell.FLOOR, Cell.OBSTACLE, Cell.GATE, Cell.UNMEASURED]]
    assert no_gates.tolist() == [[Cell.FLOOR, Cell.BUMP, Cell.OBSTACLE, Cell.UNMEASURED]]
    assert grid.tolist() == [[Cell.FLOOR, Cell.BUMP, Cell.GATE, Cell.UNMEASURED]]


@pytest.mark.parametrize("function, limit", [(None, 1.0), (5, 1.0), (len, 0.0), (len, -1.0), (len, float("nan"))])
def test_what_is_no_function_and_no_limit_is_refused(function, limit):
    with pytest.raises(InputError, match="HostPlanner"):
        HostPlanner(function, limit)


def first(classes, levels, start_ij, goal_ij, costs):
    return None


def second(classes, levels, start_ij, goal_ij, costs):
    return None


def test_planners_are_sent_to_other_processes_with_their_functions(tmp_path):
    """Their numbers are those of one process: the other one may have numbered others before."""
    planners = HostPlanner(second, 3.0), HostPlanner(first), HostPlanner(second, 3.0)
    batch = jax.tree.map(lambda *leaves: np.stack(leaves), *planners)
    (tmp_path / "sent").write_bytes(pickle.dumps((HostPlanner(first, 2.0), batch)))
    code = (
        "import pickle, sys; from jaxbiped.planning import host_planner as there;"
        "there.HostPlanner(len); one, many = pickle.load(open(sys.argv[1], 'rb'));"
        "known = [there.FUNCTIONS[k] for k in many.number];"
        "print(one.function.__name__, one.limit, [(f.__name__, limit) for f, limit in known])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, tmp_path / "sent"], capture_output=True, text=True, cwd=ROOT, check=True
    )
    assert done.stdout == "first 2.0 [('second', 3.0), ('first', 10.0), ('second', 3.0)]\n"
