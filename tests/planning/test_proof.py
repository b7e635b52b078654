"""`converged` is a proof: a kernel that stops too early is seen, whichever it is."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numba import njit

from jaxbiped import planning
from jaxbiped.core import xla_ffi
from jaxbiped.planning import wavefront
from jaxbiped.planning.costs import Costs, Rules, tables
from jaxbiped.planning.kernels import LANES, grids, heading, heading_sweep, line_sweep, solvers

H, W = 5, 7
CLASSES = np.ones((LANES, H, W), np.int8)
GOALS = np.repeat([[2, 3]], LANES, 0).astype(np.int32)
GOALS[0] = -1  # of this one nothing is reached, which is settled at once


@njit
def give_up(edges, goals, cost, first, height, width, batch, half):
    """A kernel that leaves all but the goal as it was."""
    return 0


def test_a_kernel_of_grids_that_stops_early_does_not_converge():
    leaves = [np.full(LANES, c, np.float32) for c in (1, 1, 5, 10, 100)]
    rules = Rules(*(jnp.full(LANES, flag) for flag in (False, True, True)))
    read = jax.tree.map(np.asarray, tables(Costs(*map(jnp.asarray, leaves)), rules))
    early, whole = [True] + [False] * (LANES - 1), [True] * LANES
    for sweeps, expected in ((lambda lanes: give_up, early), (line_sweep.sweeps, whole)):
        size = grids.room_size(H, W)
        steps, settled = np.zeros(LANES, np.int32), np.zeros(LANES, bool)
        grids.make_solver(sweeps)(
            CLASSES.ravel(), 0 * CLASSES.ravel(), *(table.ravel() for table in read), GOALS,
            np.zeros(CLASSES.size, np.float32), steps, settled,
            np.zeros(size), np.zeros(4 * size, np.float32), np.zeros(3 * size, np.int8), H, W,
        )  # fmt: skip
        assert settled.tolist() == expected


@pytest.mark.parametrize("lanes", [1, LANES])
def test_a_kernel_of_edges_that_stops_early_does_not_converge(lanes, monkeypatch):
    """`lanes`: of Dijkstra's method, and of line sweeps."""
    name = f"test_give_up_{lanes}"
    xla_ffi.register(name, solvers.solver(give_up, lanes))
    monkeypatch.setattr(solvers, "registered", lambda kernel: (name, lanes))
    edges = planning.edge_costs(CLASSES, 0 * CLASSES)
    jax.clear_caches()
    out = planning.cost_to_go(edges, GOALS, method="line_sweep")
    jax.clear_caches()
    assert out.converged.tolist() == [True] + [False] * (LANES - 1)


def test_a_wavefront_that_stops_early_does_not_converge(monkeypatch):
    edges = planning.edge_costs(CLASSES, 0 * CLASSES)
    monkeypatch.setattr(wavefront, "most_rounds", lambda height, width: 2)
    jax.clear_caches()
    out = planning.cost_to_go(edges, GOALS, method="wavefront")
    jax.clear_caches()
    assert out.converged.tolist() == [True] + [False] * (LANES - 1)


def test_headings_swept_too_few_times_do_not_converge():
    moves = planning.heading_moves(CLASSES, 0 * CLASSES, planning.Times(), planning.Rules())
    lanes = heading_sweep.LANES
    time, face = (np.array(a)[:lanes].ravel() for a in (moves.time, moves.face))
    turn, field, settled = np.full(lanes, 5, np.float32), np.zeros(time.size, np.float32), np.zeros(lanes, bool)
    for rounds, expected in ((1, [True] + [False] * (lanes - 1)), (0, [True] * lanes)):
        heading_sweep.make_solver(rounds)(time, face, turn, GOALS[:lanes], field, settled, 0, H, W)
        assert settled.tolist() == expected


def test_headings_whose_times_are_too_long_are_not_settled():
    """The proof of Dijkstra's method over headings, on a field that is made wrong before it."""
    moves = planning.heading_moves(CLASSES[:1], 0 * CLASSES[:1], planning.Times(), planning.Rules())
    time, face = (np.array(a).ravel() for a in (moves.time, moves.face))
    cost = np.zeros(time.size)
    assert heading.solve_arena(time, face, 5.0, 2, 3, H, W, cost)
    assert heading.is_settled(time, face, 5.0, H, W, cost)
    cost[np.argmax(cost)] += 1e-3
    assert not heading.is_settled(time, face, 5.0, H, W, cost)
