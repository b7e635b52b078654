"""Cost-to-go by line sweeps: compiled for a CPU, many arenas a vector.

`cost` and `edges` are [(H + 2) * (W + 2) * B], the batch last, with a ring of inf. `edges` are the costs of leaving a
cell in each of the eight `DIRECTIONS`; where the last four are the first four once more (`half`), a move costs what the
move back costs, and the first four are all that is known.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from jaxbiped.planning.costs import DIRECTIONS
from jaxbiped.planning.kernels.names import LANES as LANES
from jaxbiped.planning.kernels.vector_ops import relaxation

DI, DJ = (tuple(int(d) for d in column) for column in DIRECTIONS.T)
LEFT = DJ[:4]  # columns that the first four directions go


def sweeps(lanes: int):
    """A function `solve_lanes(edges, goals, cost, first, height, width, batch, half) -> steps` of many arenas a vector.

    Relaxes arenas `first` to `first + lanes - 1` until nothing changes: passes down, up, down, ... Each row relaxes
    from the row before and along itself, rightwards and then leftwards, so that a path which never turns back settles
    in one pass. After a pass all moves but those towards the other side are settled: a pass that changes nothing,
    after one the other way, ends the search. A row is skipped unless the row before has changed in this pass or the
    last; a goal changes its row before the first pass, for the rows above it as for those below. `steps` [lanes]
    uint64: passes until nothing changed in each arena.
    """
    relax = relaxation(lanes)

    @njit(nogil=True)
    def solve_lanes(edges, goals, cost, first, height, width, batch, half):
        line = (width + 2) * batch
        ahead, right, middle, left = edges[0], edges[1], edges[2], edges[3]
        back, back_right, back_middle, back_left = edges[4], edges[5], edges[6], edges[7]
        aside = np.array([batch * dj for dj in LEFT])
        steps = np.zeros(lanes, np.uint64)
        # rows[step % 2]: those that the last pass changed; before the first, those of the goals
        rows = np.zeros((2, height + 2), np.bool_)
        for arena in range(first, first + lanes):
            if 0 <= goals[arena, 0] < height:
                rows[0, goals[arena, 0] + 1] = True
        step, changed = 0, np.uint64(1)
        while changed or step < 2:
            changed = np.uint64(0)
            up = step % 2 == 1
            was, now = rows[step % 2], rows[1 - step % 2]
            side = 1 if up else -1
            a, b, c = side * aside[1], side * aside[2], side * aside[3]
            e, f, g = (right, middle, left) if up else (back_right, back_middle, back_left)
            # half: the cost of a move back stands in the cell that it leads to
            back_a, back_b, back_c = (
                (side * line + a, side * line + b, side * line + c) if half and not up else (0, 0, 0)
            )
            west = -batch if half else 0
            for q in range(height):
                i = height - q if up else q + 1
                before = i + side
                if not (was[before] or now[before] or (step == 0 and was[i])):
                    now[i] = False
                    continue
                less = np.uint64(0)
                n = i * line + batch + first
                m = n + side * line
                for _ in range(width):
                    less |= relax(cost, n, m + a, e, n + back_a)
                    less |= relax(cost, n, m + b, f, n + back_b)
                    less |= relax(cost, n, m + c, g, n + back_c)
                    less |= relax(cost, n, n - batch, back, n + west)
                    n, m = n + batch, m + batch
                for _ in range(width):
                    n -= batch
                    less |= relax(cost, n, n + batch, ahead, n)
                now[i] = less != 0 or (step == 0 and was[i])
                changed |= less
            step += 1
            for lane in range(lanes):
                if (changed >> np.uint64(lane)) & np.uint64(1):
                    steps[lane] = step
        return steps

    return solve_lanes


def proof(lanes: int):
    """A function `unsettled(edges, cost, first, height, width, batch, half) -> lanes`, arguments as of `sweeps`.

    It relaxes every cell once more from all its neighbours. Bits of the lanes whose cost that lowers are set: their
    field is not exact. Costs that are made of edges, and that no relaxation lowers, are the least.
    """
    relax = relaxation(lanes)

    @njit(nogil=True)
    def unsettled(edges, cost, first, height, width, batch, half):
        line = (width + 2) * batch
        less = np.uint64(0)
        for k in range(8):
            to = DI[k] * line + DJ[k] * batch
            back = to if half and k >= 4 else 0
            for i in range(1, height + 1):
                n = i * line + batch + first
                for _ in range(width):
                    less |= relax(cost, n, n + to, edges[k], n + back)
                    n += batch
        return less

    return unsettled
