"""The graph of the 2D grid map: eight directions, and what a move in each of them costs (paper, Eq. 1)."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.mapping.grid import Cell

# (di, dj) of the eight moves; row i is along y and column j along x, so that direction k heads for k * 45 deg
DIRECTIONS = np.array([(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)])
BASE_PITCH = 0.05  # [m] the pitch that the paper's costs are given for (paper, 3)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Costs:
    """C0 to C4 of the paper's Eq. 1 on its 5 cm pitch; scalars, or one a arena. All traced, none negative."""

    c0: Float[Array, "*B"] | float = 1.0  # distance: a straight move; an oblique one costs sqrt(2) c0
    c1: Float[Array, "*B"] | float = 1.0  # motion: on one level
    c2: Float[Array, "*B"] | float = 5.0  # motion: into, in and out of a gate
    c3: Float[Array, "*B"] | float = 10.0  # motion: one level up or down
    c4: Float[Array, "*B"] | float = 100.0  # motion: an end is unmeasured

    def at_pitch(self, pitch: float) -> Costs:
        """The same costs on a grid of another `pitch` [m].

        Costs are per metre or per event, never per cell. C0 (distance), C1 (level walking), C2 (squatting
        along under a gate) and C4 (measuring on the way) are paid along the way: they scale with
        pitch / 0.05 m. C3 is an event (one step over an edge takes 96 s on any grid, Table 2): it does not
        scale. So the same way on two grids costs the same but for the one cell at which it crosses an edge.
        """
        scale = pitch / BASE_PITCH
        return Costs(self.c0 * scale, self.c1 * scale, self.c2 * scale, self.c3, self.c4 * scale)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Rules:
    """What the robot may do; scalars, or one a arena. All traced."""

    corner_cutting: Bool[Array, "*B"] | bool = False  # oblique moves past one blocked orthogonal neighbour
    bumps: Bool[Array, "*B"] | bool = True  # step up and down; else bump cells are obstacles
    gates: Bool[Array, "*B"] | bool = True  # squat through; else gate cells are obstacles


def blocked_cells(classes: Int[Array, "*S"], rules: Rules) -> Bool[Array, "*S"]:
    """Cells that are obstacles under `rules`, whose leaves broadcast against `classes` from the right."""
    bump = (classes == Cell.BUMP) & ~jnp.asarray(rules.bumps)
    gate = (classes == Cell.GATE) & ~jnp.asarray(rules.gates)
    return (classes == Cell.OBSTACLE) | bump | gate


def move_cost(k: int, here, there, side_a, side_b, costs: Costs, rules: Rules):
    """Cost of the move in direction `k`, inf where it is forbidden.

    `here` and `there` are (blocked, class, level) of its two ends; `side_a` and `side_b` are blocked at the two
    orthogonal neighbours of an oblique move. Precedence as in the paper's 2.3 and its figure 9: an end
    blocked or more than one level: forbidden; an unmeasured end: C4; one level: C3; a gate: C2; else C1.
    """
    (blocked_a, class_a, level_a), (blocked_b, class_b, level_b) = here, there
    rise = jnp.abs(level_a.astype(jnp.int32) - level_b.astype(jnp.int32))
    forbidden = blocked_a | blocked_b | (rise > 1)
    oblique = bool(np.all(DIRECTIONS[k] != 0))
    if oblique:
        forbidden |= (side_a & side_b) | ((side_a | side_b) & ~jnp.asarray(rules.corner_cutting))
    unmeasured = (class_a == Cell.UNMEASURED) | (class_b == Cell.UNMEASURED)
    gate = (class_a == Cell.GATE) | (class_b == Cell.GATE)
    c0, c1, c2, c3, c4 = (jnp.asarray(c, jnp.float32) for c in (costs.c0, costs.c1, costs.c2, costs.c3, costs.c4))
    motion = jnp.where(unmeasured, c4, jnp.where(rise == 1, c3, jnp.where(gate, c2, c1)))
    distance = c0 * np.float32(np.sqrt(2)) if oblique else c0
    return jnp.where(forbidden, jnp.inf, distance + motion)


def edges_batch_last(
    classes: Int[Array, "H W B"], levels: Int[Array, "H W B"], costs: Costs, rules: Rules
) -> Float[Array, "8 H W B"]:
    """`edge_costs` with the batch as the last axis, which is what the kernels want.

    The cost of a move is that of the move back, so that four directions are computed and four are shifted.
    """
    height, width, _ = classes.shape
    ring = ((1, 1), (1, 1), (0, 0))
    classes = jnp.pad(classes, ring, constant_values=int(Cell.OBSTACLE))
    levels = jnp.pad(levels, ring)
    blocked = blocked_cells(classes, rules)

    def at(array, di, dj):
        return array[1 + di : 1 + di + height, 1 + dj : 1 + dj + width]

    def ends(di, dj):
        return at(blocked, di, dj), at(classes, di, dj), at(levels, di, dj)

    out = []
    for k in range(4):
        di, dj = DIRECTIONS[k]
        out.append(move_cost(k, ends(0, 0), ends(di, dj), at(blocked, di, 0), at(blocked, 0, dj), costs, rules))
    for k in range(4):
        di, dj = DIRECTIONS[k]
        out.append(at(jnp.pad(out[k], ring, constant_values=jnp.inf), -di, -dj))
    return jnp.stack(out)


def edge_costs(
    classes: Int[Array | np.ndarray, "B H W"],
    levels: Int[Array | np.ndarray, "B H W"],
    costs: Costs | None = None,
    rules: Rules | None = None,
) -> Float[Array, "B 8 H W"]:
    """Cost of leaving each cell in each of `DIRECTIONS`, inf where that is forbidden (paper, Eq. 1 and 2.3).

    Args:
      classes: a `mapping.grid.Cell` each.
      levels: height of each cell's ground in steps; ends more than one step apart are not joined.
      costs, rules: scalars or [B] leaves; the paper's by default.

    Deviation: the paper says nothing of oblique moves past the corner of an obstacle; `Rules.corner_cutting`.
    """
    last = (jnp.moveaxis(jnp.asarray(a), 0, -1) for a in (classes, levels))
    return jnp.moveaxis(edges_batch_last(*last, costs or Costs(), rules or Rules()), -1, 0)
