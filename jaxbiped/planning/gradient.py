"""The cost of the best path as a function of the costs C0 to C4, with its gradient."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.core.batching import unfold
from jaxbiped.core.checks import whole_number
from jaxbiped.planning.arguments import grid_arguments
from jaxbiped.planning.cost_field import field
from jaxbiped.planning.costs import FORBIDDEN, IN_GATE, LEVEL, STEP, UNMEASURED, Costs, Rules, edge_costs
from jaxbiped.planning.path import Path, path_arguments, read_path

KIND = Costs(c0=0.0, c1=float(LEVEL), c2=float(IN_GATE), c3=float(STEP), c4=float(UNMEASURED))
"""Under these costs the cost of a move is its kind."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class MoveCounts:
    """The moves of a path, counted by shape and by kind. An invalid path has none."""

    straight: Int[Array, "*B"]
    diagonal: Int[Array, "*B"]
    level: Int[Array, "*B"]  # on one level
    gate: Int[Array, "*B"]  # into, in and out of a gate
    step: Int[Array, "*B"]  # one level up or down
    unmeasured: Int[Array, "*B"]
    valid: Bool[Array, "*B"]

    def per_cost(self) -> Costs:
        """How often each cost is incurred: the gradient of the path's cost (paper, Eq. 1). Leaves [B], float32."""
        single = jax.tree.map(lambda n: n.astype(jnp.float32), replace(self, valid=None))
        return Costs(
            single.straight + math.sqrt(2.0) * single.diagonal,
            single.level,
            single.gate,
            single.step,
            single.unmeasured,
        )


def move_counts(path: Path, classes: Any, levels: Any, rules: Rules | None = None) -> MoveCounts:
    """Count the kinds of moves of paths over class grids. Leading axes broadcast, including those of `path`.

    Args:
      path: paths read on these grids.
      classes, levels, rules: as for `field`.

    Raises:
      InputError: an argument of another rank, shape or dtype, or a value out of range where values are concrete.
    """
    batch, inputs = grid_arguments(classes, levels, rules or Rules(), arrays=path_arguments(path))
    return unfold(_move_counts(*inputs), batch)


def _move_counts(classes, levels, rules: Rules, cells_ij, directions, valid) -> MoveCounts:
    kinds = edge_costs(classes, levels, KIND, rules)
    moves = (directions >= 0) & valid[:, None]
    ij, direction = jnp.where(moves[..., None], cells_ij[:, :-1], 0), jnp.maximum(directions, 0)
    kind = kinds[jnp.arange(len(ij))[:, None], direction, ij[..., 0], ij[..., 1]]
    kind, diagonal = jnp.where(moves, kind, FORBIDDEN), direction % 2 == 1

    def count(what):
        return jnp.sum(moves & what, axis=1, dtype=jnp.int32)

    by_kind = (count(kind == k) for k in (LEVEL, IN_GATE, STEP, UNMEASURED))
    return MoveCounts(count(~diagonal), count(diagonal), *by_kind, jnp.asarray(valid))


def path_cost(
    costs: Costs,
    classes: Any,
    levels: Any,
    rules: Rules | None = None,
    *,
    start_ij: Any,
    goal_ij: Any,
    heading: Any = None,
    max_length: int | None = None,
) -> Float[Array, "*B"]:
    """The cost of the best path of each arena (paper, Eq. 1), which `jax.grad` differentiates by the costs.

    The cost of one path is linear in C0 to C4, with coefficients that count how often each is incurred. The minimum
    over all paths is therefore concave and piecewise linear in them, and where one path is the best, its counts are the
    gradient (the envelope theorem). They are read from that path; the relaxation that found it is not unrolled. Where
    several paths are equally good there is a kink; the counts are then those of the path chosen by the tie rule of
    `path.pick`, which is a supergradient: f(c') <= f(c) + counts . (c' - c) for all c', up to `path.TIE` of f(c).

    The gradient with respect to everything else is zero. There is no forward mode, and C0 must be positive: moves that
    cost nothing may be missing in the counts. Leading axes broadcast. May be called inside `jit`, `vmap` and `scan`.

    Args:
      costs: leaves [*B].
      classes, levels, rules, goal_ij: as for `field`.
      start_ij, heading: as for `read_path`.
      max_length: static; longer paths count as none. By default no path is too long.

    Returns:
      inf if there is no path; the gradient there is zero.

    Raises:
      InputError: an argument of another rank, shape or dtype, or a value out of range where values are concrete.
    """
    points = {"start_ij": start_ij, "goal_ij": goal_ij, "heading": -1 if heading is None else heading}
    batch, (classes, levels, rules, each, *ends) = grid_arguments(classes, levels, rules or Rules(), costs, **points)
    height, width = classes.shape[1:]
    length = max(height * width - 1, 0) if max_length is None else whole_number("max_length", max_length)
    return unfold(least(each, (classes, levels, rules, *ends), length), batch)


@partial(jax.custom_vjp, nondiff_argnums=(2,))
def least(costs: Costs, fixed, length: int) -> Float[Array, "B"]:
    """`path_cost` with [B] costs, and all arguments that are not differentiated in one tuple."""
    return solve(costs, fixed, length).cost


def solve(costs: Costs, fixed, length: int) -> Path:
    """The best path; its cost is inf if it is not valid."""
    classes, levels, rules, start_ij, goal_ij, heading = fixed
    to_go = field(classes, levels, costs, rules, goal_ij)
    path = read_path(to_go, edge_costs(classes, levels, costs, rules), start_ij, length, heading)
    return replace(path, cost=jnp.where(path.valid, path.cost, jnp.inf))


def forward(costs: Costs, fixed, length: int) -> tuple[Float[Array, "B"], Costs]:
    """The cost, and what the reverse pass needs: its gradient."""
    path = solve(costs, fixed, length)
    return path.cost, move_counts(path, *fixed[:3]).per_cost()


def reverse(length: int, paid: Costs, cotangent: Float[Array, "B"]):
    """The cotangents of the costs; none for the rest."""
    return jax.tree.map(lambda n: jnp.where(n > 0, cotangent * n, 0.0), paid), None


least.defvjp(forward, reverse)
