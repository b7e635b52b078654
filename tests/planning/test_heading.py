"""Planning over (cell, heading) against plain loops and heapq."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped import planning
from jaxbiped.errors import InputError
from jaxbiped.mapping.grid import Cell
from jaxbiped.planning import Times
from jaxbiped.planning.heading.edge_direction import crossing_faces, dense_faces
from tests.planning import heading_oracle, oracle

H, W, B = 9, 11, 12
PAPER = planning.Rules(*(np.full(B, flag) for flag in (False, True, True)))
METHODS = ["line_sweep", "dijkstra", "wavefront"]
RELATIVE = 1e-5  # of sums in float32 against float64


@pytest.fixture(scope="module")
def maps():
    """Cells thrown at random, with times and rules of their own: (classes, levels, times, rules, goal_ij)."""
    rng = np.random.default_rng(0)
    classes, levels = oracle.random_grids(rng, B, H, W)
    classes[:4], levels[:4] = smooth(rng, 4)
    times = Times(*(rng.uniform(0, 100, B).astype(np.float32) for _ in range(7)))
    rules = planning.Rules(*(rng.random(B) < 0.5 for _ in range(3)))
    return classes, levels, times, rules, np.stack([rng.integers(0, H, B), rng.integers(0, W, B)], -1)


def smooth(rng, count):
    """Maps with one long bump at an angle, as real ones are."""
    i, j = np.mgrid[:H, :W]
    angle, off = rng.uniform(0, np.pi, (count, 1, 1)), rng.uniform(-2, 2, (count, 1, 1))
    bump = np.abs((i - H / 2) * np.sin(angle) + (j - W / 2) * np.cos(angle) - off) < 1.8
    return np.where(bump, Cell.BUMP, Cell.FLOOR).astype(np.int8), bump.astype(np.int8)


def one(tree, b):
    return jax.tree.map(lambda leaf: leaf[b].item(), tree)


def reference(maps, b, pitch=0.05):
    classes, levels, times, rules, _ = maps
    rules = one(rules, b)
    return heading_oracle.moves(
        classes[b], levels[b], one(times, b), pitch,
        corner_cutting=rules.corner_cutting, bumps=rules.bumps, gates=rules.gates,
    )  # fmt: skip


@pytest.mark.parametrize("method", METHODS)
def test_field_is_dijkstra(maps, method):
    out = planning.heading_field(*maps, method=method)
    assert out.converged.all()
    crossings = 0
    for b in range(B):
        time, face = reference(maps, b)
        np.testing.assert_allclose(out.moves.time[b], time, rtol=RELATIVE)
        real = np.isfinite(time)
        np.testing.assert_array_equal(np.asarray(out.moves.face[b])[real], face[real])
        crossings += (face != np.arange(8)[:, None, None])[real].sum()
        field = heading_oracle.time_to_go(time, face, one(maps[2], b).turn, maps[4][b])
        np.testing.assert_allclose(out.cost[b], field, rtol=RELATIVE)
    assert crossings > 20  # moves that face otherwise than they lead


@pytest.mark.parametrize("pitch", [0.1, 0.025])
def test_moves_on_other_pitches(maps, pitch):
    out = planning.heading_field(*maps, pitch).moves
    for b in (0, 5):
        np.testing.assert_allclose(out.time[b], reference(maps, b, pitch)[0], rtol=RELATIVE)


def floor():
    """B maps of nothing but floor: all tests share their shapes, and what is compiled for them."""
    classes = np.full((B, H, W), Cell.FLOOR, np.int8)
    return classes, 0 * classes


def fill(*rows):
    """An array of B rows, filled up with the last."""
    return np.array([*rows, *rows[-1:] * (B - len(rows))])


def read(start_ij, goal_ij, yaw=0.0, **times):
    """The way on a plain floor: (directions, time, valid)."""
    times = Times(*(np.full(B, t, np.float32) for t in vars(Times(**times)).values()))
    field = planning.heading_field(*floor(), times, PAPER, fill(goal_ij))
    path = planning.heading_path(field, fill(start_ij), fill(np.float32(yaw)), H * W)
    return np.asarray(path.directions[0])[: int(path.length[0])].tolist(), float(path.cost[0]), bool(path.valid[0])


def test_way_takes_what_the_field_says_and_what_the_clock_counts(maps):
    field = planning.heading_field(*maps)
    rng = np.random.default_rng(1)
    start_ij, heading = np.stack([rng.integers(0, H, B), rng.integers(0, W, B)], -1), rng.integers(0, 8, B)
    yaw = (heading * np.pi / 4).astype(np.float32)
    path = planning.heading_path(field, start_ij, yaw, H * W)
    expected = field.cost[np.arange(B), heading, start_ij[:, 0], start_ij[:, 1]]
    np.testing.assert_allclose(path.cost, expected, rtol=RELATIVE)
    np.testing.assert_array_equal(path.valid, np.isfinite(expected))
    np.testing.assert_allclose(
        planning.path_time(field.moves, field.turn, path, yaw), np.where(path.valid, path.cost, np.inf), rtol=RELATIVE
    )
    assert path.valid.sum() > B // 3


def test_never_slower_than_the_way_of_eq_1(maps):
    classes, levels, _, rules, goal_ij = maps
    field = planning.heading_field(classes, levels, None, rules, goal_ij)
    edges = planning.edge_costs(classes, levels, planning.Costs(), rules)
    start_ij = np.roll(goal_ij, 1, axis=0)
    cheap = planning.read_path(planning.cost_to_go(edges, goal_ij), edges, start_ij, H * W, np.zeros(B, int))
    yaw = np.zeros(B, np.float32)
    best = planning.heading_path(field, start_ij, yaw, H * W)
    np.testing.assert_array_equal(best.valid, cheap.valid)  # reachable by the same rules
    taken = planning.path_time(field.moves, field.turn, cheap, yaw)
    assert (np.asarray(best.cost)[best.valid] <= np.asarray(taken)[best.valid] * (1 + RELATIVE)).all()
    assert (np.asarray(best.cost)[best.valid] < np.asarray(taken)[best.valid] - 1).any()


@pytest.mark.parametrize("method", METHODS)
def test_turns_that_take_no_time_leave_a_field_of_cells(maps, method):
    classes, levels, times, rules, goal_ij = maps
    out = planning.heading_field(classes, levels, replace(times, turn=np.zeros(B)), rules, goal_ij, method=method)
    cells = planning.cost_to_go(out.moves.time, goal_ij).cost
    np.testing.assert_allclose(out.cost, np.broadcast_to(cells[:, None], out.cost.shape), rtol=RELATIVE)


def test_quickest_way_has_the_fewest_turns_where_turns_are_dear():
    """Two rows up, five columns along: any staircase is as long, one has a single turn of 45 degrees in it."""
    directions, time, valid = read((0, 0), (2, 5), turn=60.0)
    assert valid and directions == [0, 0, 0, 1, 1]
    np.testing.assert_allclose(time, 3 * 26 + 2 * (16 * np.sqrt(2) + 10) + 60, rtol=RELATIVE)
    # facing obliquely, it walks obliquely first
    assert read((0, 0), (2, 5), yaw=np.pi / 4, turn=60.0)[0] == [1, 1, 0, 0, 0]


def test_yaw_need_not_be_a_heading():
    near, far = (read((2, 2), (2, 5), yaw=yaw)[1] for yaw in (0.1, -np.pi + 0.1))
    np.testing.assert_allclose(
        (near, far), (78 + 0.1 / (np.pi / 4) * 5, 78 + 20 - 0.1 / (np.pi / 4) * 5), rtol=RELATIVE
    )


def test_edge_at_an_angle_is_faced_square():
    """Straight moves up a bump whose edge runs at 45 degrees turn to it, and walk off what the step leads aside."""
    i, j = np.mgrid[:H, :W]
    bump = np.broadcast_to(i + j >= 9, (B, H, W))
    classes = np.where(bump, Cell.BUMP, Cell.FLOOR).astype(np.int8)
    paper = Times(*(np.full(B, t, np.float32) for t in vars(Times()).values()))
    moves = planning.heading_field(classes, bump.astype(np.int8), paper, PAPER, fill((8, 8))).moves
    assert moves.face[0, :3, 4, 4].tolist() == [1, 1, 1] and moves.face[0, 5, 5, 5] == 5
    aside = 16 * np.sqrt(0.5)
    np.testing.assert_allclose(moves.time[0, :3, 4, 4], [106 + aside, 106, 106 + aside], rtol=RELATIVE)


@pytest.mark.parametrize("method", METHODS)
def test_nasty_maps(method):
    classes, levels = floor()
    classes[0] = Cell.OBSTACLE
    classes[1, :, 3] = Cell.OBSTACLE  # no way across
    classes[2, 1:4, 1:4] = Cell.OBSTACLE
    classes[2, 2, 2] = Cell.FLOOR  # walled in on all eight sides
    goal_ij = fill((2, 5), (2, 5), (2, 5), (2, 2), (H, 0), (2, -1))
    field = planning.heading_field(classes, levels, None, PAPER, goal_ij, method=method)
    path = planning.heading_path(field, fill((2, 2)), fill(np.float32(1)), H * W)
    assert path.valid[:6].tolist() == [False, False, False, True, False, False]
    blocked = np.array([0, 1, 2, 4, 5])
    assert not path.length[:6].any() and path.cost[3] == 0.0 and np.isinf(path.cost[blocked]).all()
    outside = planning.heading_path(field, fill((-1, 0), (H, 0), (0, W)), fill(np.float32(0)), H * W)
    assert not outside.valid.any() and np.isinf(outside.cost).all()


@pytest.mark.parametrize("method", METHODS)
def test_one_cell(method):
    one = np.full((1, 1, 1), Cell.FLOOR, np.int8)
    field = planning.heading_field(one, 0 * one, goal_ij=np.zeros((1, 2), int), method=method)
    assert field.cost.tolist() == [[[[0.0]]] * 8]


@pytest.mark.parametrize("method", METHODS)
def test_huge_and_missing_times(method):
    straight, turn = fill(3600.0, 0.0, np.nan, -1.0, np.inf), fill(3600.0, 0.0, 5.0)
    times = Times(straight=straight, measure=fill(3600.0, 0.0, 10.0), turn=turn)
    field = planning.heading_field(*floor(), times, PAPER, fill((4, 4)), method=method)
    path = planning.heading_path(field, fill((0, 0)), fill(np.float32(0)), H * W)
    assert field.converged[:5].tolist() == path.valid[:5].tolist() == [True, True, False, False, False]
    np.testing.assert_allclose(path.cost[0], 3600 * (4 * (np.sqrt(2) + 1) + 1), rtol=RELATIVE)
    assert path.length[1] == 4  # even where nothing takes any time


def test_longest_corridor():
    passable = np.zeros((H, W), bool)
    passable[::2] = True
    for i in range(1, H, 2):
        passable[i, -1 if i % 4 == 1 else 0] = True
    classes = np.where(passable, Cell.FLOOR, Cell.OBSTACLE).astype(np.int8)[None]
    times = Times(straight=16.37, turn=5.11, measure=10.13)
    fields = [
        planning.heading_field(classes, 0 * classes, times, goal_ij=np.zeros((1, 2), int), method=m) for m in METHODS
    ]
    for field in fields[1:]:
        np.testing.assert_allclose(fields[0].cost, field.cost, rtol=RELATIVE)


@pytest.mark.slow
def test_large_maps():
    """Where sums are float64: cells thrown at random, one map and many, which go different ways."""
    classes, levels = oracle.random_grids(np.random.default_rng(7), 3, 40, 50)
    rows, goal_ij = np.array([0, 1, 2, 0, 1]), np.array([[3, 4], [20, 48], [39, 0], [3, 4], [20, 48]])
    few = planning.heading_field(classes, levels, goal_ij=goal_ij[:3])
    many = planning.heading_field(classes[rows], levels[rows], goal_ij=goal_ij)
    np.testing.assert_array_equal(many.cost, np.asarray(few.cost)[rows])
    assert np.isfinite(few.cost).mean() > 0.3


def test_sixty_four_times_compile_once(maps):
    classes, levels, _, rules, goal_ij = maps
    traces = 0

    @jax.jit
    def run(times):
        nonlocal traces
        traces += 1
        return planning.heading_field(classes, levels, times, rules, goal_ij).cost

    rng = np.random.default_rng(5)
    for _ in range(64):
        run(Times(*(float(t) for t in rng.uniform(0, 100, 7))))
    assert traces == 1


def test_errors():
    with pytest.raises(InputError, match="goal_ij"):
        planning.heading_field(*floor())
    with pytest.raises(InputError, match="line_sweep"):
        planning.heading_field(*floor(), goal_ij=fill((0, 0)), method="dial")


@pytest.mark.parametrize("pitch", [0.1, 0.05, 0.025])
def test_faces_are_the_same_on_any_device(maps, pitch):
    classes, levels = jnp.asarray(maps[0]), jnp.asarray(maps[1])
    known = (classes != Cell.UNMEASURED) & (classes != Cell.OBSTACLE)
    ours, dense = crossing_faces(classes, levels, pitch), dense_faces(known, levels, pitch)
    own = np.arange(8)[:, None, None]
    assert (ours != own).sum() > 20
    # the compiled one leaves moves that are over no edge as they are
    np.testing.assert_array_equal(np.where(ours == own, own, dense), ours)
    over = np.asarray(planning.heading_field(*maps, pitch).moves.face) != own
    np.testing.assert_array_equal(np.asarray(dense)[over], np.asarray(ours)[over])


@pytest.mark.parametrize("method", METHODS)
def test_no_arenas(method):
    none = np.zeros((0, 4, 5), np.int8)
    field = planning.heading_field(none, none, goal_ij=np.zeros((0, 2), int), method=method)
    assert field.cost.shape == (0, 8, 4, 5) and field.converged.shape == (0,)
