"""The graph of the 2D grid map: eight directions, and the cost of a move in each of them (paper, Eq. 1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, Int8

from jaxbiped.core.batching import unfold
from jaxbiped.mapping.grid import Cell
from jaxbiped.planning.arguments import grid_arguments

# (di, dj) of the eight moves; row i is along y and column j along x, so direction k points to k * 45 deg
DIRECTIONS = np.array([(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)])
BASE_PITCH = 0.05  # [m] the pitch for which the paper gives its costs (paper, 3)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Costs:
    """C0 to C4 of the paper's Eq. 1 on its 5 cm pitch; scalars, or one per arena. All traced, none negative."""

    c0: Float[Array, "*B"] | float = 1.0  # distance: a straight move; a diagonal one costs sqrt(2) c0
    c1: Float[Array, "*B"] | float = 1.0  # motion: on one level
    c2: Float[Array, "*B"] | float = 5.0  # motion: into, in and out of a gate
    c3: Float[Array, "*B"] | float = 10.0  # motion: one level up or down
    c4: Float[Array, "*B"] | float = 100.0  # motion: an end is unmeasured

    def at_pitch(self, pitch: float) -> Costs:
        """The same costs on a grid of another `pitch` [m].

        Costs are per metre or per event, never per cell. C0 (distance), C1 (level walking), C2 (squatting
        along under a gate) and C4 (measuring on the way) are incurred along the path: they scale with
        pitch / 0.05 m. C3 is an event (one step over an edge takes 96 s on any grid, Table 2): it does not
        scale. So the same path on two grids costs the same, except for the one cell at which it crosses an edge.
        """
        scale = pitch / BASE_PITCH
        return Costs(self.c0 * scale, self.c1 * scale, self.c2 * scale, self.c3, self.c4 * scale)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Rules:
    """What the robot may do; scalars, or one per arena. All traced."""

    corner_cutting: Bool[Array, "*B"] | bool = False  # diagonal moves past one blocked orthogonal neighbour
    bumps: Bool[Array, "*B"] | bool = True  # step up and down; else bump cells are obstacles
    gates: Bool[Array, "*B"] | bool = True  # squat through; else gate cells are obstacles


# kinds of moves, worst last: the precedence of the paper's 2.3 is a plain maximum over ends and rise
LEVEL, IN_GATE, STEP, UNMEASURED, FORBIDDEN = range(5)


def cell_kinds(classes: Int[Array, "*S"], rules: Rules) -> Int8[Array, "*S"]:
    """The kind of the moves that touch a cell, as far as the cell decides; leaves of `rules` broadcast from the right.

    An invalid class counts as an obstacle.
    """
    bump = (classes == Cell.BUMP) & ~jnp.asarray(rules.bumps)
    gate = classes == Cell.GATE
    solid = (classes < 0) | (classes >= Cell.OBSTACLE)
    blocked = solid | bump | (gate & ~jnp.asarray(rules.gates))
    kind = jnp.where(blocked, FORBIDDEN, jnp.where(classes == Cell.UNMEASURED, UNMEASURED, jnp.where(gate, IN_GATE, 0)))
    return kind.astype(jnp.int8)


def move_kind(here, there, sides, corner_cutting) -> Int8[Array, "*S"]:
    """The kind of a move. `here`, `there`: (kind, level) of its ends; `sides`: the kinds of the two orthogonal
    neighbours of a diagonal move, None for a straight one."""
    (kind_a, level_a), (kind_b, level_b) = here, there
    rise = jnp.abs(level_a.astype(jnp.int16) - level_b.astype(jnp.int16))
    rise = jnp.where(rise == 0, LEVEL, jnp.where(rise == 1, STEP, FORBIDDEN)).astype(jnp.int8)
    kind = jnp.maximum(kind_a, kind_b)
    kind = jnp.where(kind == UNMEASURED, UNMEASURED, jnp.maximum(kind, rise)).astype(jnp.int8)
    if sides is not None:
        one, both = jnp.maximum(*sides) == FORBIDDEN, jnp.minimum(*sides) == FORBIDDEN
        kind = jnp.where(both | (one & ~jnp.asarray(corner_cutting)), FORBIDDEN, kind).astype(jnp.int8)
    return kind


def kind_cost(kind: Int8[Array, "*S"], costs: Costs, diagonal: bool) -> Float[Array, "*S"]:
    """C_distance + C_motion of a move (paper, Eq. 1); inf if it is forbidden."""
    c0, c1, c2, c3, c4 = (jnp.asarray(c, jnp.float32) for c in (costs.c0, costs.c1, costs.c2, costs.c3, costs.c4))
    distance = c0 * np.float32(np.sqrt(2)) if diagonal else c0
    out = jnp.where(kind == FORBIDDEN, jnp.inf, distance + c4)
    for what, cost in ((STEP, c3), (IN_GATE, c2), (LEVEL, c1)):
        out = jnp.where(kind == what, distance + cost, out)
    return out


def tables(costs: Costs, rules: Rules) -> tuple[Int8[Array, "B C"], Float[Array, "B 2 K"], Int8[Array, "B"]]:
    """Costs and rules [B] as tables: the kind of a cell of each class, the cost of a straight and of a diagonal move of
    each kind, and whether corners may be cut."""

    def each(count):
        return jnp.broadcast_to(jnp.arange(count, dtype=jnp.int8)[:, None], (count, *costs.c0.shape))

    prices = jnp.stack([kind_cost(each(FORBIDDEN + 1), costs, diagonal) for diagonal in (False, True)])
    return cell_kinds(each(len(Cell)), rules).T, jnp.moveaxis(prices, -1, 0), rules.corner_cutting.astype(jnp.int8)


def half_edges(
    classes: Int[Array, "H W B"], levels: Int[Array, "H W B"], costs: Costs, rules: Rules
) -> tuple[Float[Array, "H2 W2 B"], ...]:
    """Costs of the first four directions, batch last, with a ring of inf (H2 = H + 2, W2 = W + 2).

    A move costs the same in both directions, so these four are all.
    """
    height, width, _ = classes.shape
    ring = ((1, 2), (2, 2), (0, 0))
    kinds = jnp.pad(cell_kinds(classes, rules), ring, constant_values=FORBIDDEN)
    levels = jnp.pad(levels, ring)

    def at(array, di, dj):
        return array[di : di + height + 2, 1 + dj : 1 + dj + width + 2]

    def edges(k):
        di, dj = (int(d) for d in DIRECTIONS[k])
        here, there = ((at(kinds, *c), at(levels, *c)) for c in ((0, 0), (di, dj)))
        sides = (at(kinds, di, 0), at(kinds, 0, dj)) if di and dj else None
        return kind_cost(move_kind(here, there, sides, rules.corner_cutting), costs, sides is not None)

    return tuple(edges(k) for k in range(4))


def edge_costs(
    classes: Any, levels: Any, costs: Costs | None = None, rules: Rules | None = None
) -> Float[Array, "*B 8 H W"]:
    """Cost of leaving each cell in each of `DIRECTIONS`, inf where it is forbidden (paper, Eq. 1 and 2.3).

    Leading axes broadcast. May be called inside `jit`, `vmap` and `grad`.

    Args:
      classes: [*B, H, W], integers, one `mapping.grid.Cell` each; any other value in a traced grid is an obstacle.
      levels: [*B, H, W], integers, height of each cell's ground in steps, from -128 to 127; ends more than one step
        apart are not joined. The level of an unmeasured cell is not known, and not read. In a traced grid a cell with a
        level out of range is an obstacle.
      costs, rules: leaves [*B]; the paper's by default.

    Raises:
      InputError: an argument of another rank, shape or dtype, or a value out of range where values are concrete.

    Deviation: the paper does not mention diagonal moves past the corner of an obstacle; see `Rules.corner_cutting`.
    """
    batch, inputs = grid_arguments(classes, levels, costs or Costs(), rules or Rules())
    return unfold(_edge_costs(*inputs), batch)


@jax.jit
def _edge_costs(classes, levels, costs: Costs, rules: Rules) -> Float[Array, "B 8 H W"]:
    last = (jnp.moveaxis(jnp.asarray(a), 0, -1) for a in (classes, levels))
    half = half_edges(*last, costs, rules)
    height, width = classes.shape[1:]
    back = [(1, 1)] * 4 + [(1 + int(di), 1 + int(dj)) for di, dj in DIRECTIONS[4:]]
    out = [half[k % 4][i : i + height, j : j + width] for k, (i, j) in enumerate(back)]
    return jnp.moveaxis(jnp.stack(out), -1, 0)
