"""Edge costs and fields against plain loops and scipy's Dijkstra."""

import numpy as np
import pytest

from jaxbiped import planning
from tests.planning import oracle

H, W, B = 13, 17, 70  # 70: more than one chunk, and not a multiple of it
RELATIVE = 1e-5  # what the method promises against float64 Dijkstra


@pytest.fixture(scope="module")
def grids():
    rng = np.random.default_rng(0)
    classes, levels = oracle.random_grids(rng, B, H, W)
    goal_ij = np.stack([rng.integers(0, H, B), rng.integers(0, W, B)], -1)
    return classes, levels, goal_ij


@pytest.mark.parametrize("method", ["line_sweep", "wavefront"])
def test_field_is_dijkstra(grids, method):
    classes, levels, goal_ij = grids
    out = planning.field(classes, levels, goal_ij=goal_ij, method=method)
    assert out.converged.all()
    for b in range(B):
        expected = oracle.cost_to_go(oracle.edge_costs(classes[b], levels[b]), goal_ij[b])
        np.testing.assert_allclose(out.cost[b], expected, rtol=RELATIVE)
