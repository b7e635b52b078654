"""Read moves from a cost-to-go field, with one rule for ties."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Bool, Float, Int, Int8

from jaxbiped.core.batching import fold, unfold
from jaxbiped.core.checks import cells, flags, integers, leading_shape, reals, whole_number
from jaxbiped.errors import InputError
from jaxbiped.mapping.grid import Cell
from jaxbiped.planning.arguments import grid_arguments, indices
from jaxbiped.planning.cost_field import CostToGo
from jaxbiped.planning.costs import DIRECTIONS, Costs, Rules, cell_kinds, kind_cost, move_kind

TIE = 1e-6  # relative: paths whose costs differ by less are equally good; ten roundings of a float32


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Path:
    """Cells from start to goal, and the moves between them; padded with -1."""

    cells_ij: Int[Array, "*B L1 2"]  # L1 = max_length + 1
    directions: Int8[Array, "*B L"]  # move from cell k to cell k + 1
    length: Int[Array, "*B"]  # number of moves
    cost: Float[Array, "*B"]  # inf: no path
    valid: Bool[Array, "*B"]  # reaches the goal within max_length moves


def path_arguments(path: Path) -> dict[str, tuple[Any, str]]:
    """The fields of a path that are read, checked, in the form for `leading_shape`."""
    if path.cells_ij.shape[-2:-1] != (path.directions.shape[-1] + 1,):
        raise InputError("must have one cell more than there are directions", field="path.cells_ij")
    return {
        "path.cells_ij": (integers("path.cells_ij", path.cells_ij, "L1 2"), "L1 2"),
        "path.directions": (integers("path.directions", path.directions, "L", between=(-1, 7)), "L"),
        "path.valid": (flags("path.valid", path.valid), ""),
    }


def pick(ahead: Float[Array, "B 8"], downhill: Bool[Array, "B 8"], heading: Int[Array, "B"]) -> Int8[Array, "B"]:
    """The direction to take, -1 for none, if direction k costs `ahead[k]` all the way to the goal.

    Ties: of the directions within `TIE` of the best, the present heading if it is among them (fewer turns),
    else the first in the order of `DIRECTIONS`. Only `downhill` directions count, so that reading terminates.
    """
    ahead = jnp.where(downhill, ahead, jnp.inf)
    best = ahead.min(-1, keepdims=True)
    good = (ahead <= best * (1 + TIE)) & jnp.isfinite(ahead)
    keeps = jnp.take_along_axis(good, jnp.maximum(heading, 0)[:, None], -1)[:, 0] & (heading >= 0)
    choice = jnp.where(keeps, heading, jnp.argmax(good, -1))
    return jnp.where(good.any(-1), choice, -1).astype(jnp.int8)


def read_path(field: CostToGo, edge_costs: Any, start_ij: Any, max_length: int, heading: Any = None) -> Path:
    """The lowest-cost path from each start, read from a field; ties as in `pick`.

    It ends at the goal; where moves cost nothing it may end at a cell from which the goal is reached for
    nothing. Across more expensive plateaus of moves that cost nothing (or less than the float32 resolution of the cost
    to go) it takes the fewest moves. Leading axes broadcast. May be called inside `jit`, `vmap` and `scan`.

    Args:
      field: field of these edge costs. Where it did not converge there is no path.
      edge_costs: [*B, 8, H, W], none negative or NaN.
      start_ij: [*B, 2], integers; outside the grid there is no path.
      max_length: static; largest number of moves.
      heading: [*B], direction of the move before the first, -1 for none (the default).

    Raises:
      InputError: an argument of another rank, shape or dtype, or a heading that is not a direction.
    """
    cost, edges = reals("field.cost", field.cost, "H W"), reals("edge_costs", edge_costs, "8 H W")
    start = cells("start_ij", start_ij)
    heading = indices("heading", -1 if heading is None else heading)
    converged = flags("field.converged", field.converged)
    given = {"field.cost": (cost, "H W"), "field.converged": (converged, ""), "edge_costs": (edges, "8 H W")}
    batch = leading_shape(**given, start_ij=(start, "2"), heading=(heading, ""))
    length = whole_number("max_length", max_length)
    if math.prod(cost.shape[-2:]) == 0:
        return no_path(fold(start, batch, 1), length, batch)
    cost = jnp.where(fold(converged, batch, 0)[:, None, None], fold(cost, batch, 2), jnp.inf)
    inputs = cost, fold(edges, batch, 3), fold(start, batch, 1), fold(heading, batch, 0)
    return unfold(_read_path(*inputs, max_length=length), batch)


def no_path(start, max_length: int, batch: tuple[int, ...]) -> Path:
    """The result for a grid without cells."""
    count = len(start)
    cells_ij = jnp.full((count, max_length + 1, 2), -1).at[:, 0].set(start)
    directions = jnp.full((count, max_length), -1, jnp.int8)
    path = Path(cells_ij, directions, jnp.zeros(count, jnp.int32), jnp.full(count, jnp.inf), jnp.zeros(count, bool))
    return unfold(path, batch)


@partial(jax.jit, static_argnames="max_length")
def _read_path(cost, edges, start, heading, max_length: int) -> Path:
    near = jnp.stack([_shifted(cost, di, dj) for di, dj in DIRECTIONS], 1)
    ahead, own = edges + near, cost[:, None]
    good = (ahead <= ahead.min(1, keepdims=True) * (1 + TIE)) & jnp.isfinite(ahead)
    flat = good & (near == own)
    rank = jnp.where((good & (near < own)).any(1), 0.0, jnp.inf)

    def closer(rank):  # moves on a plateau to its nearest descent
        near_rank = jnp.stack([_shifted(rank, di, dj) for di, dj in DIRECTIONS], 1)
        return jnp.minimum(rank, jnp.where(flat, near_rank + 1, jnp.inf).min(1)), near_rank

    rank = lax.while_loop(lambda s: s[1], lambda s: (new := closer(s[0])[0], jnp.any(new < s[0])), (rank, True))[0]
    downhill = (near < own) | (flat & (closer(rank)[1] < rank[:, None]))
    arena, (height, width) = jnp.arange(cost.shape[0]), cost.shape[1:]
    inside = ((start >= 0) & (start < jnp.array([height, width]))).all(-1)

    def step(state, _):
        ij, heading = state
        at = (arena, slice(None), ij[:, 0], ij[:, 1])
        there = inside & (cost[arena, ij[:, 0], ij[:, 1]] > 0)
        direction = pick(ahead[at], downhill[at] & there[:, None], heading)
        moves = direction >= 0
        ij = jnp.where(moves[:, None], ij + jnp.asarray(DIRECTIONS, jnp.int32)[direction], ij)
        return (ij, jnp.where(moves, direction, heading)), (jnp.where(moves[:, None], ij, -1), direction)

    first = jnp.where(inside[:, None], start, 0), jnp.asarray(heading, jnp.int32)
    (last, _), (passed, directions) = lax.scan(step, first, None, length=max_length)
    total = jnp.where(inside, cost[arena, first[0][:, 0], first[0][:, 1]], jnp.inf)
    valid = inside & jnp.isfinite(total) & (cost[arena, last[:, 0], last[:, 1]] == 0)
    passed = jnp.moveaxis(jnp.concatenate([start[None], passed]), 0, 1)
    return Path(passed, directions.T, (directions >= 0).sum(0, dtype=jnp.int32), total, valid)


def _shifted(array, di, dj):
    """`array[b, i + di, j + dj]`, inf outside."""
    _, height, width = array.shape
    padded = jnp.pad(array, ((0, 0), (1, 1), (1, 1)), constant_values=jnp.inf)
    return padded[:, 1 + di : 1 + di + height, 1 + dj : 1 + dj + width]


def next_step(
    field_cost: Any,
    classes: Any,
    levels: Any,
    costs: Costs,
    rules: Rules,
    ij: Any,
    heading: Any,
    length: int = 1,
) -> Int8[Array, "*B {length}"]:
    """First `length` moves of the path from each robot's cell, read from `field(...).cost`.

    Edge costs are computed around the cell only. It is the path of `read_path`, with the robot's present `heading`
    (a direction, -1 for none) as the move before the first. -1 where the path has ended, where there is none,
    and on a plateau of moves that cost nothing, or less than the float32 resolution of the cost to go (`read_path`
    crosses those). Leading axes broadcast. May be called
    inside `jit`, `vmap` and `scan`.

    Args:
      field_cost: [*B, H, W].
      classes, levels, costs, rules: as for `field`.
      ij: [*B, 2], integers; outside the grid there is no path.
      heading: [*B].
      length: static.

    Raises:
      InputError: an argument of another rank, shape or dtype, or a value out of range where values are concrete.
    """
    length, arrays = whole_number("length", length), {"field_cost": (reals("field_cost", field_cost, "H W"), "H W")}
    batch, inputs = grid_arguments(classes, levels, costs, rules, arrays=arrays, ij=ij, heading=heading)
    if math.prod(inputs[0].shape[1:]) == 0:
        return jnp.full((*batch, length), -1, jnp.int8)
    return unfold(_next_step(*inputs, length=length), batch)


@partial(jax.jit, static_argnames="length")
def _next_step(classes, levels, costs, rules, field_cost, ij, heading, length: int) -> Int8[Array, "B {length}"]:
    classes, levels = jnp.asarray(classes), jnp.asarray(levels)
    arena = jnp.arange(field_cost.shape[0])[:, None]
    offsets = jnp.asarray(DIRECTIONS, jnp.int32)

    def cell(array, ij, outside):
        i, j = ij[..., 0], ij[..., 1]
        inside = (i >= 0) & (i < array.shape[1]) & (j >= 0) & (j < array.shape[2])
        return jnp.where(inside, array[arena, jnp.where(inside, i, 0), jnp.where(inside, j, 0)], outside)

    def step(state, _):
        ij, heading = state
        around = ij[:, None] + offsets
        classes_near = jnp.concatenate([cell(classes, around, int(Cell.OBSTACLE)), cell(classes, ij[:, None], 0)], 1)
        kinds = cell_kinds(classes_near.T, rules)  # [9, B]: the eight neighbours and the cell itself
        levels_near, here = cell(levels, around, 0).T, (kinds[8], cell(levels, ij[:, None], 0)[:, 0])
        moves = []
        for k in range(8):
            # the orthogonal neighbours of a diagonal direction are the directions adjacent to it
            sides = (kinds[k - 1], kinds[(k + 1) % 8]) if k % 2 else None
            kind = move_kind(here, (kinds[k], levels_near[k]), sides, rules.corner_cutting)
            moves.append(kind_cost(kind, costs, sides is not None))
        own, ahead = cell(field_cost, ij[:, None], jnp.inf), cell(field_cost, around, jnp.inf)
        direction = pick(jnp.stack(moves, -1) + ahead, ahead < own, heading)
        moved = jnp.where(direction[:, None] >= 0, ij + offsets[direction], ij)
        return (moved, jnp.where(direction >= 0, direction, heading).astype(heading.dtype)), direction

    return lax.scan(step, (ij, heading), None, length=length)[1].T
