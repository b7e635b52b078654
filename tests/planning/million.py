"""A million maps of nasty structure against scipy's Dijkstra: `python -m tests.planning.million [COUNT]`, some minutes.

`make test-all` runs it after the tests.

The same generator as of `test_adversarial.py`, with seeds of its own. It prints the greatest relative error of every
method, and ends with status 1 where a field is further off than `RELATIVE`, or does not converge.
"""

from __future__ import annotations

import sys

import numpy as np

from jaxbiped import planning
from tests.planning import adversarial
from tests.planning.test_adversarial import METHODS, RELATIVE, SHAPES

BATCH = 5000


def error(cost, wanted) -> float:
    """Greatest relative error; inf where one is finite and the other is not."""
    cost, wanted = np.asarray(cost, np.float64), np.asarray(wanted)
    if not np.array_equal(np.isfinite(cost), np.isfinite(wanted)):
        return np.inf
    known = np.isfinite(wanted) & (wanted > 0)
    return float(np.max(np.abs(cost[known] / wanted[known] - 1), initial=0.0))


def main() -> int:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    worst, done, proven = dict.fromkeys((*METHODS, "edges"), 0.0), 0, True
    while done < count:
        shape = SHAPES[done // BATCH % len(SHAPES)]
        rng = np.random.default_rng([5, done])
        classes, levels, goal_ij = adversarial.maps(rng, shape, BATCH)
        costs, rules = adversarial.costs(rng, BATCH)
        edges = np.asarray(planning.edge_costs(classes, levels, costs, rules))
        wanted = adversarial.cost_to_go(edges, goal_ij)
        # every tenth batch by the slower methods, too
        for method in METHODS if done // BATCH % 40 < len(SHAPES) else METHODS[:1]:
            out = planning.field(classes, levels, costs, rules, goal_ij, method=method)
            worst[method], proven = max(worst[method], error(out.cost, wanted)), proven and bool(out.converged.all())
        edges = adversarial.edges(rng, shape, BATCH)
        out = planning.cost_to_go(edges, goal_ij)
        wanted = adversarial.cost_to_go(edges, goal_ij)
        worst["edges"], proven = max(worst["edges"], error(out.cost, wanted)), proven and bool(out.converged.all())
        done += BATCH
        if done % 100_000 == 0 or done >= count:
            print(
                f"{done:,} maps and as many sets of edges: greatest relative errors {worst}, all proven: {proven}",
                flush=True,
            )
    return int(max(worst.values()) > RELATIVE or not proven)


if __name__ == "__main__":
    sys.exit(main())
