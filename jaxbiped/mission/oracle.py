"""The oracle plan: what each strategy could do with perfect knowledge.

It distinguishes failures of sensing from failures of planning, and unsolvable arenas from unsolved ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from jaxbiped import planning
from jaxbiped.arenas.arena import Arena
from jaxbiped.arenas.moving_boxes import only
from jaxbiped.core.ready_programs import ready_jit
from jaxbiped.jax_settings import with_own_settings
from jaxbiped.mapping import Body, Cell, truth_grid
from jaxbiped.mission.goal import goal_cell
from jaxbiped.mission.params import MissionParams, MissionSpec
from jaxbiped.mission.route import nearest_direction
from jaxbiped.motion.selection import cell_of


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class OraclePlan:
    """Oracle plans under each of the parameters and for each arena."""

    reachable: Bool[Array, "P A"]
    cost: Float[Array, "P A"]  # of Eq. (1), from the start's cell to the goal's; inf if there is no path
    length: Float[Array, "P A"]  # [m] of that path, between cell centres; NaN if there is none or it is very long


@with_own_settings
@ready_jit(static_argnames=("spec",))
def oracle_plan(arenas: Arena, params: MissionParams, spec: MissionSpec) -> OraclePlan:
    """Plans on the true class grid of each arena [A], under each of the parameters [P].

    Moving boxes are left out. `blind_stop` has one path, the one that it plans on an empty floor; its goal is reachable
    if that path is all floor.
    """
    arenas, grid = jax.vmap(partial(only, moving=False))(arenas), spec.grid
    start_ij = jax.vmap(cell_of, in_axes=(0, 0, None))(arenas.start_xyyaw[:, 0], arenas.start_xyyaw[:, 1], grid)
    heading = jax.vmap(nearest_direction)(arenas.start_xyyaw[:, 2])
    row = jnp.arange(start_ij.shape[0])

    moves = jnp.asarray(planning.DIRECTIONS)

    def grids(body: Body):
        return jax.vmap(truth_grid, in_axes=(0, None, None))(arenas, grid, body)

    first_body = jax.tree.map(lambda leaf: leaf[0], params.body)
    first_grids = grids(first_body)

    def plan(own: MissionParams) -> tuple[Float[Array, "A"], Float[Array, "A"]]:
        # Most studies do not sweep the body: then true grids are made once.
        same = jnp.all(jnp.stack(jax.tree.leaves(jax.tree.map(jnp.equal, own.body, first_body))))
        classes, levels = jax.lax.cond(same, lambda: first_grids, lambda: grids(own.body))
        costs, rules = own.costs.at_pitch(grid.pitch), own.strategy.rules()
        floor, flat = jnp.full_like(classes, Cell.FLOOR), jnp.zeros_like(levels)
        blind = own.strategy.blind
        plan_classes, plan_levels = jnp.where(blind, floor, classes), jnp.where(blind, flat, levels)
        goal_ij = jax.vmap(goal_cell, in_axes=(0, None, 0, None, None))(
            arenas.goal_xy, own.limits.goal_radius, plan_classes, rules, grid
        )
        to_go = planning.field(plan_classes, plan_levels, costs, rules, goal_ij).cost
        cost = to_go[row, start_ij[:, 0], start_ij[:, 1]]
        path = planning.next_step(
            to_go, plan_classes, plan_levels, costs, rules, start_ij, heading, length=2 * sum(grid.shape)
        )
        steps = jnp.where((path >= 0)[..., None], moves[jnp.maximum(path, 0)], 0)
        cells = jnp.moveaxis(start_ij[:, None] + jnp.cumsum(steps, axis=1), 1, 0)
        free = way_is_floor(cells, classes)
        # counted, not summed: a sum of many reals depends on the order of addition in a batch of this size
        straight, diagonal = (jnp.sum((path >= 0) & (path % 2 == odd), axis=1) for odd in (0, 1))
        length = grid.pitch * (straight + diagonal * np.float32(np.sqrt(2)))
        whole = jnp.all(cells[-1] == goal_ij, axis=1)
        return jnp.where(blind & ~free, jnp.inf, cost), jnp.where(whole, length, jnp.nan)

    cost, length = jax.lax.map(plan, params)
    return OraclePlan(jnp.isfinite(cost), cost, length)


def way_is_floor(cells_ij: Int[Array, "L A 2"], classes: Int[Array, "A H W"]) -> Bool[Array, "A"]:
    """Whether every cell of each path is floor."""
    row = jnp.arange(classes.shape[0])
    return jnp.all(classes[row, cells_ij[..., 0], cells_ij[..., 1]] == Cell.FLOOR, axis=0)
