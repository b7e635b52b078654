"""Searched paths against those that are read off whole fields: the same moves and cost, bit for bit, on nasty maps."""

import threading

import jax
import numpy as np
import pytest
from numba import njit

from jaxbiped import planning
from jaxbiped.errors import InputError
from jaxbiped.planning import Costs, PathSearch, Rules, shortest_path
from jaxbiped.planning.kernels import bucket_queue, map_astar
from tests.planning import adversarial, oracle

SHAPES = ((1, 9), (9, 1), (5, 7), (12, 9), (28, 36))
COUNT = 150  # maps of each shape, six queries each
QUERIES = 6


def one(batch, k):
    return jax.tree.map(lambda leaf: np.asarray(leaf)[k], batch)


def assert_same_paths(classes, levels, costs, rules, queries, headings):
    """Every query of one map, by a search and off the field."""
    search = PathSearch(classes, levels, costs, rules)
    edges = planning.edge_costs(classes, levels, costs, rules)
    starts, goals = queries[:, 0], queries[:, 1]
    fields = planning.field(classes, levels, costs, rules, goals)
    paths = planning.read_path(
        fields, np.broadcast_to(edges, (len(queries), *edges.shape)), starts, classes.size, headings
    )
    paths = jax.device_get(paths)
    for q, (start, goal, heading) in enumerate(zip(starts, goals, headings, strict=True)):
        found = search.path(start, goal, heading)
        assert (found is not None) == paths.valid[q]
        inside = ((start >= 0) & (start < classes.shape)).all()
        cost = np.asarray(fields.cost)[q][tuple(start)] if inside else np.inf
        assert search.cost(start, goal) == cost
        if found is not None:
            length = paths.length[q]
            np.testing.assert_array_equal(found.directions, paths.directions[q, :length])
            np.testing.assert_array_equal(found.cells_ij, paths.cells_ij[q, : length + 1])
            assert found.cost == cost and found.expanded <= bucket_queue.MOST * classes.size + classes.size


@pytest.mark.parametrize("shape", SHAPES)
def test_paths_are_those_of_the_field_on_nasty_maps(shape):
    """Corridors, combs, spirals, costs from 1e-6 to 1e4, zeros, ties; starts and goals on obstacles, too."""
    compare_on_nasty_maps(np.random.default_rng([5, *shape]), shape, COUNT)


@pytest.mark.slow
@pytest.mark.parametrize("shape", SHAPES)
def test_paths_are_those_of_the_field_on_more_of_them(shape):
    compare_on_nasty_maps(np.random.default_rng([9, *shape]), shape, 10 * COUNT)


def compare_on_nasty_maps(rng, shape, count):
    classes, levels, goal_ij = adversarial.maps(rng, shape, count)
    costs, rules = adversarial.costs(rng, count)
    for k in range(count):
        queries = np.stack([rng.integers(0, n, (QUERIES, 2)) for n in shape], -1)
        queries[: QUERIES // 2, 1] = goal_ij[k]
        queries[0, 0] = goal_ij[k]
        headings = rng.integers(-1, 8, QUERIES)
        assert_same_paths(classes[k], levels[k], one(costs, k), one(rules, k), queries, headings)


@pytest.mark.parametrize(
    "make", [oracle.maze, lambda rng, h, w: oracle.random_grids(rng, 1, h, w)[0][0]], ids=["maze", "thrown"]
)
def test_larger_maps(make):
    rng = np.random.default_rng(6)
    classes = np.asarray(make(rng, 65, 97), np.int8)
    levels = (classes == 2).astype(np.int8)
    free = np.argwhere(classes != 4)
    queries = free[rng.integers(len(free), size=(12, 2))]
    assert_same_paths(classes, levels, Costs(), Rules(), queries, np.full(12, -1))


def test_a_search_looks_at_a_part_of_the_map():
    classes = np.ones((200, 300), np.int8)
    found = shortest_path(classes, 0 * classes, start_ij=(100, 20), goal_ij=(100, 280))
    assert (
        found.expanded < 1000 and found.cost == 520.0 and (found.directions == 0).all() and len(found.directions) == 260
    )
    assert found.cells_ij[0].tolist() == [100, 20] and found.cells_ij[-1].tolist() == [100, 280]


def test_a_pool_that_fills_is_emptied_of_cells_that_were_improved_since():
    """With no more room than the queue had entries at most, so that it is refilled close to its fullest."""
    rng = np.random.default_rng(7)
    classes = rng.choice(5, p=[0.3, 0.3, 0.1, 0.2, 0.1], size=(40, 40)).astype(np.int8)
    levels = (classes == 2).astype(np.int8)
    search = PathSearch(classes, levels)
    whole = np.asarray(planning.field(classes, levels, goal_ij=(20, 20)).cost)
    size, room, goal = 42 * 42, bucket_queue.room_of.py_func(42 * 42), 21 * 42 + 21
    advance = bucket_queue.expansion(directed=False)

    @njit
    def settle(kind, level, moves, mark, cost, prices, pool, queue):
        bucket_queue.begin(goal, cost, mark, pool, queue)
        aim = (0, 0.0, 0.0, 0.0)
        advance(kind, level, moves, mark, cost, 42, prices, aim, 0.5, bucket_queue.WORDS, pool, queue, pool)

    kind, level, moves, mark = (search._rooms[0][k * size : (k + 1) * size] for k in range(4))
    prices, peaks = search._prices.ravel().astype(float), []
    for _ in range(8):
        cost, pool, queue = np.full(size, np.inf), np.empty(room, np.int64), np.empty(bucket_queue.QUEUE, np.int64)
        mark[:] = 0
        settle(kind, level, moves, mark, cost, prices, pool, queue)
        np.testing.assert_array_equal(cost.reshape(42, 42)[1:-1, 1:-1].astype(np.float32), whole)
        peaks.append(int(queue[bucket_queue.USED]))
        room = peaks[-1] + 6  # with less than eight to spare it is refilled
    assert len(set(peaks)) > 1


@pytest.mark.parametrize("how", ["zero", "uneven"])
def test_what_a_search_abandons_is_read_off_the_field(monkeypatch, how):
    classes = np.ones((20, 30), np.int8)
    if how == "uneven":
        monkeypatch.setattr(map_astar, "ABANDONED", map_astar.FOUND)  # whatever the kernel says
    costs = Costs(0.0, 0.0, 0.0, 0.0, 0.0) if how == "zero" else Costs()
    search = PathSearch(classes, 0 * classes, costs)
    found = search.path((3, 4), (9, 25))
    assert found.cost == (0.0 if how == "zero" else 21 * 2 + 6 * np.float32(np.sqrt(2)) - 6)
    assert search.cost((3, 4), (9, 25)) == found.cost


def test_ends_outside_and_on_obstacles_and_one_cell():
    classes = np.ones((5, 6), np.int8)
    classes[2, 2] = 4
    search = PathSearch(classes, 0 * classes)
    for start, goal in (((0, 0), (5, 0)), ((-1, 0), (0, 0)), ((0, 0), (0, 6)), ((2, 2), (0, 0)), ((0, 0), (2, 2))):
        assert search.path(start, goal) is None and search.cost(start, goal) == np.inf
    here = search.path((2, 2), (2, 2))
    assert here.cost == 0 and len(here.directions) == 0 and here.cells_ij.tolist() == [[2, 2]]
    alone = PathSearch(np.ones((1, 1), np.int8), np.zeros((1, 1), np.int8))
    assert alone.path((0, 0), (0, 0)).cost == 0 and alone.path((0, 0), (0, 1)) is None


@pytest.mark.parametrize(
    "costs",
    [
        Costs(c0=np.inf),
        Costs(c1=np.inf),
        Costs(c2=np.inf, c3=np.inf, c4=np.inf),
        Costs(c0=3e38, c1=3e38),
        Costs(c0=1e-30, c1=0.0, c4=1e30),
    ],
)
def test_costs_without_bound_and_at_the_ends_of_float32(costs, recwarn):
    rng = np.random.default_rng(10)
    classes = rng.choice(5, size=(20, 24), p=[0.2, 0.4, 0.1, 0.2, 0.1]).astype(np.int8)
    search = PathSearch(classes, (classes == 2).astype(np.int8), costs)
    for start, goal in rng.integers(0, [20, 24], (40, 2, 2)):
        grids = classes, (classes == 2).astype(np.int8), costs
        for method in ("line_sweep", "dijkstra"):
            there = np.asarray(planning.field(*grids, goal_ij=goal, method=method).cost)[tuple(start)]
            assert search.cost(start, goal) == there
        assert (search.path(start, goal) is not None) == np.isfinite(there)
    assert not [w for w in recwarn if "overflow" in str(w.message)]


def test_threads_share_a_map():
    rng = np.random.default_rng(8)
    classes = oracle.maze(rng, 41, 41, loops=60)
    classes = np.asarray(classes, np.int8)
    search, levels = PathSearch(classes, 0 * classes), 0 * classes
    free = np.argwhere(classes != 4)
    ends = free[rng.integers(len(free), size=(40, 2))]
    wanted = [np.asarray(planning.field(classes, levels, goal_ij=g).cost)[tuple(s)] for s, g in ends]
    found = [None] * len(ends)

    def work(first):
        for k in range(first, len(ends), 4):
            found[k] = search.cost(*ends[k])

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == wanted


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"classes": np.ones((2, 5, 6), np.int8)}, r"classes: must be one map \[H, W\] \(got \[2, 5, 6\]\)"),
        ({"classes": np.full((5, 6), 9)}, "classes: "),
        ({"levels": np.zeros((5, 7), np.int8)}, "levels: "),
        ({"costs": Costs(c1=-1.0)}, "costs: must not be negative or NaN"),
        ({"costs": Costs(c2=float("nan"))}, "costs"),
        ({"start_ij": (1.5, 2)}, "start_ij: "),
        ({"start_ij": (1, 2, 3)}, "start_ij: "),
        ({"goal_ij": [(1, 2)]}, r"goal_ij: must be one cell \[2\]"),
        ({"heading": 8}, "heading: "),
        ({"heading": -2}, "heading: "),
    ],
)
def test_bad_input(change, said):
    given = {
        "classes": np.ones((5, 6), np.int8),
        "levels": np.zeros((5, 6), np.int8),
        "start_ij": (0, 0),
        "goal_ij": (4, 5),
    }
    with pytest.raises(InputError, match=said):
        shortest_path(**given | change)


def test_inside_jit_it_says_what_to_use():
    classes = np.ones((5, 6), np.int8)
    with pytest.raises(InputError, match=r"classes, .*must be concrete.* use field and read_path"):
        jax.jit(lambda grid: shortest_path(grid, 0 * classes, start_ij=(0, 0), goal_ij=(4, 5)).cost)(classes)
    search = PathSearch(classes, 0 * classes)
    with pytest.raises(InputError, match="start_ij: must be concrete"):
        jax.vmap(lambda cell: search.cost(cell, (4, 5)))(np.zeros((3, 2), int))
