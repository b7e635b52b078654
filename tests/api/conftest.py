"""One study with planners of all kinds, played once for all tests of the public API."""

import heapq
from pathlib import Path

import numpy as np
import pytest

import jaxbiped as jb
from jaxbiped.planning import DIRECTIONS
from sweeps.examples.planners.clearance import Clearance
from tests.reference import planning as reference

EXAMPLES = Path(__file__).parents[2] / "sweeps" / "examples"


def plain_dijkstra(classes, levels, start_ij, goal_ij, costs):
    """The least cost by Eq. 1, with a heap: what the package's own planner finds."""
    edges = reference.edge_costs(classes, levels, costs, jb.Rules())[:, 1:-1, 1:-1]
    cost, before, heap = {start_ij: 0.0}, {}, [(0.0, start_ij)]
    while heap:
        here, (i, j) = heapq.heappop(heap)
        if (i, j) == goal_ij:
            way = [goal_ij]
            while way[-1] != start_ij:
                way.append(before[way[-1]])
            return way[::-1]
        if here > cost[i, j]:
            continue
        for k in np.flatnonzero(np.isfinite(edges[:, i, j])):
            there = i + int(DIRECTIONS[k][0]), j + int(DIRECTIONS[k][1])
            if here + edges[k, i, j] < cost.get(there, np.inf):
                cost[there], before[there] = here + edges[k, i, j], (i, j)
                heapq.heappush(heap, (cost[there], there))
    return None


def raises(classes, levels, start_ij, goal_ij, costs):
    raise ZeroDivisionError("no map is good enough")


def through_walls(classes, levels, start_ij, goal_ij, costs):
    """Straight, whatever is there."""
    return jb.cells_along([(i + 0.5, j + 0.5) for i, j in (start_ij, goal_ij)])


def for_ever(classes, levels, start_ij, goal_ij, costs):
    while True:
        pass


def gives_up(classes, levels, start_ij, goal_ij, costs):
    return None


@pytest.fixture(scope="session")
def study():
    return jb.Study(
        jb.RandomArenas(count=12),
        [
            "full",
            plain_dijkstra,
            raises,
            through_walls,
            gives_up,
            jb.Strategy("slow", jb.HostPlanner(for_ever, limit=0.05)),
            jb.Strategy("on floor", jb.HostPlanner(plain_dijkstra), bumps=False, gates=False),
            jb.Strategy("priceless", Clearance(price=0.0)),
            Clearance(),
        ],
        seed=5,
    )


@pytest.fixture(scope="session")
def results(study):
    return jb.evaluate(study)
