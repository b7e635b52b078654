"""Planners: from a robot's knowledge at a decision to the first moves of its path. Built-in ones, and the base class.

A planner is a frozen dataclass that is a pytree (`jax.tree_util.register_dataclass`): its type and its static fields
choose the compiled program, its other fields are numbers that a sweep may change. Missions whose planners are of one
kind share a program, whatever their numbers.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Int8

from jaxbiped.errors import InputError
from jaxbiped.planning.cost_field import cost_to_go
from jaxbiped.planning.cost_field import field as cost_field
from jaxbiped.planning.costs import DIRECTIONS, Costs, Rules, cell_kinds, edge_costs, move_kind
from jaxbiped.planning.costs import FORBIDDEN as FORBIDDEN_KIND
from jaxbiped.planning.heading import HeadingField, Times, heading_field, heading_path
from jaxbiped.planning.path import next_step, read_path

FINE, FAILED, TOO_SLOW = 0, 1, 2  # faults of a plan


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Problem:
    """The input of a planner at one decision. Leaves of a batch have a leading axis [B]."""

    classes: Int8[Array, "*B H W"]  # `mapping.Cell` of each cell, as the robot knows it
    levels: Int8[Array, "*B H W"]  # level of each cell's ground
    start_ij: Int[Array, "*B 2"]  # the robot's cell: row (y) and column (x)
    goal_ij: Int[Array, "*B 2"]
    heading: Int[Array, "*B"]  # index into `planning.DIRECTIONS` of the direction that the robot faces
    yaw: Float[Array, "*B"]  # [rad] the same, exactly
    costs: Costs  # of Eq. 1 on this pitch
    rules: Rules  # what the strategy may cross
    times: Times  # [s] durations of the mission's clock for each primitive
    unit_seconds: Float[Array, "*B"]  # [s] duration of a unit of Eq. 1
    surcharge: Float[Array, "*B 8 H W"] | None  # added to `edge_costs`; None: nothing
    active: Bool[Array, "*B"]  # whether the result is used; False for slots without a mission
    state: Any = None  # state of the planner from its last `Route`
    pitch: float = field(default=0.05, metadata={"static": True})  # [m]
    length: int = field(default=1, metadata={"static": True})  # number of moves needed, at least 1

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the map."""
        return self.classes.shape[-2:]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Route:
    """The result of a planner. Leaves of a batch have a leading axis [B]."""

    directions: Int8[Array, "*B n"]  # the first moves, indices into `planning.DIRECTIONS`; -1 for none
    cost_to_go: Float[Array, "*B H W"] | None = None  # remaining cost from each cell, for pictures
    cost: Float[Array, "*B"] | None = None  # by Eq. 1, of the whole path; None or NaN: not known
    seconds: Float[Array, "*B"] | None = None  # [s] time taken; None or NaN: not known
    fault: Int8[Array, "*B"] | None = None  # FINE, FAILED or TOO_SLOW; None: fine
    state: Any = None  # passed to the planner with its next problem


class Planner:
    """Base class of planners: `plan` is written for one robot, and mapped over the batch.

    A planner with memory returns its initial state from `initial_state`, and a new state in each route.
    """

    def plan(self, problem: Problem) -> Route:
        """The first `problem.length` moves of the path from `start_ij` to `goal_ij`, fewer if the path is shorter.

        Moves that the rules forbid on the map end the mission as `planner_failed`.
        """
        raise NotImplementedError(f"{type(self).__name__} has no method `plan`")

    def initial_state(self, shape: tuple[int, int]) -> Any:
        """The initial state of a mission on a map of this shape: a pytree of arrays, or None."""
        return None

    def plan_batch(self, problem: Problem) -> Route:
        """The routes of a batch [B]; the leaves of the planner also have that axis."""
        route = jax.vmap(type(self).plan)(self, problem)
        check_route(route, problem.state, type(self).__name__)
        return replace(route, fault=faults(problem, route, self))

    def whole_way(self, problem: Problem, route: Route) -> Int8[Array, "B n"]:
        """The known path ahead, for pictures, as moves like those of the route."""
        return route.directions


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class GridPlanner(Planner):
    """The lowest cost by Eq. 1 over cells: an exact field, and the best neighbour of the robot's cell (paper, 2.3).

    A subclass may have its own costs: see `edge_costs`.
    """

    def edge_costs(self, problem: Problem) -> Float[Array, "8 H W"]:
        """The cost of each move of one robot, by default that of Eq. 1; inf if it is forbidden.

        In a subclass, moves forbidden by Eq. 1 stay forbidden, whatever it returns; elsewhere costs must be finite and
        not negative, or inf.
        """
        costs = edge_costs(problem.classes, problem.levels, problem.costs, problem.rules)
        return costs if problem.surcharge is None else costs + problem.surcharge

    def plan_batch(self, problem: Problem) -> Route:
        """See `Planner`."""
        grids = problem.classes, problem.levels, problem.costs, problem.rules
        if type(self).edge_costs is not GridPlanner.edge_costs:
            return self._by_own_costs(problem)
        if problem.surcharge is None:
            to_go = cost_field(*grids, problem.goal_ij).cost
            moves = next_step(to_go, *grids, problem.start_ij, problem.heading, length=problem.length)
            return Route(moves, to_go, at(to_go, problem.start_ij))
        moves = edge_costs(*grids) + problem.surcharge
        to_go = cost_to_go(moves, problem.goal_ij)
        path = read_path(to_go, moves, problem.start_ij, problem.length, problem.heading)
        return Route(path.directions, to_go.cost)

    def whole_way(self, problem: Problem, route: Route) -> Int8[Array, "B n"]:
        """See `Planner`."""
        return self.plan_batch(replace(problem, length=3 * sum(problem.shape))).directions

    def _by_own_costs(self, problem: Problem) -> Route:
        usual = edge_costs(problem.classes, problem.levels, problem.costs, problem.rules)
        given = jax.vmap(type(self).edge_costs)(self, problem)
        if given.shape != usual.shape or not jnp.issubdtype(given.dtype, jnp.floating):
            wanted, got = list(usual.shape[1:]), f"{given.dtype} {list(given.shape[1:])}"
            raise InputError(f"edge_costs must return float32 {wanted}, not {got}", field=type(self).__name__)
        free = jnp.isfinite(usual)
        wrong = jnp.any(free & ~(given >= 0), axis=(1, 2, 3))  # also catches NaN
        moves = jnp.where(free & (given >= 0), given.astype(jnp.float32), jnp.inf)
        to_go = cost_to_go(moves, problem.goal_ij)
        path = read_path(to_go, moves, problem.start_ij, 3 * sum(problem.shape), problem.heading)
        cost = cost_along(usual, problem.start_ij, path.directions, path.valid)
        fault = jnp.where(wrong, FAILED, FINE).astype(jnp.int8)
        return Route(path.directions[:, : problem.length], to_go.cost, cost, fault=fault)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class HeadingPlanner(Planner):
    """The shortest time over cells and headings, including turns, by the mission's own clock. Of the costs, only C4
    counts.

    Deviation: the paper plans over cells, by Eq. 1 (`GridPlanner`).
    """

    def plan_batch(self, problem: Problem) -> Route:
        """See `Planner`."""
        field = self.field(problem)
        path = heading_path(field, problem.start_ij, problem.yaw, problem.length)
        return Route(path.directions, field.cost.min(1))

    def whole_way(self, problem: Problem, route: Route) -> Int8[Array, "B n"]:
        """See `Planner`."""
        return self.plan_batch(replace(problem, length=3 * sum(problem.shape))).directions

    def field(self, problem: Problem) -> HeadingField:
        """Seconds to the goal for a batch, from each cell and heading."""
        grids, extra = (problem.classes, problem.levels), None
        if problem.surcharge is not None:
            extra = problem.unit_seconds.reshape(-1, 1, 1, 1) * problem.surcharge
        return heading_field(*grids, problem.times, problem.rules, problem.goal_ij, problem.pitch, extra)


def at(grid: Float[Array, "B H W"], ij: Int[Array, "B 2"]) -> Float[Array, "B"]:
    """The value of each grid at one cell."""
    return grid[jnp.arange(grid.shape[0]), ij[:, 0], ij[:, 1]]


def cost_along(
    edges: Float[Array, "B 8 H W"], start_ij: Int[Array, "B 2"], directions: Int8[Array, "B n"], valid: Bool[Array, "B"]
) -> Float[Array, "B"]:
    """The cost of the moves from each start; NaN if they lead nowhere."""
    row, shape = jnp.arange(edges.shape[0]), jnp.array(edges.shape[2:])

    def step(carry, move):
        ij, total = carry
        k = jnp.maximum(move, 0)
        total = total + jnp.where(move >= 0, edges[row, k, ij[:, 0], ij[:, 1]], 0.0)
        there = ij + jnp.where(move[:, None] >= 0, jnp.asarray(DIRECTIONS)[k], 0)
        return (jnp.clip(there, 0, shape - 1).astype(ij.dtype), total), None

    (_, total), _ = jax.lax.scan(step, (start_ij, jnp.zeros(edges.shape[0])), directions.T)
    return jnp.where(valid, total, jnp.nan)


def check_route(route: Any, given: Any, name: str) -> None:
    """Raise `InputError` unless a planner returned a route, with a state like the one that it was given."""
    if not isinstance(route, Route):
        raise InputError(f"plan must return a Route, not {type(route).__name__}", field=name)
    wanted, left = (jax.tree.map(lambda leaf: (jnp.shape(leaf), jnp.asarray(leaf).dtype.name), state)
                   for state in (given, route.state))  # fmt: skip
    if wanted != left:
        message = (
            f"a route's state must be like that of initial_state, {wanted}, not {left} (shapes with the batch's axis)"
        )
        raise InputError(message, field=name)


def faults(problem: Problem, route: Route, planner: Planner) -> Int8[Array, "B"]:
    """Whether the moves of each route are allowed on its map, together with the fault that the planner reports.

    Raises:
      InputError: moves of another shape or type, with the planner's name.
    """
    name, count = type(planner).__name__, problem.start_ij.shape[0]
    moves = route.directions
    if not (hasattr(moves, "ndim") and moves.ndim == 2 and jnp.issubdtype(moves.dtype, jnp.integer)):
        got = f"{moves.dtype} {list(moves.shape[1:])}" if hasattr(moves, "shape") else type(moves).__name__
        raise InputError(f"a route's directions must be integers [n], not {got}", field=name)
    if moves.shape[1] < problem.length:
        message = f"a route must have at least {problem.length} moves, -1 beyond its end"
        raise InputError(message, field=name, value=list(moves.shape[1:]))
    row, shape = jnp.arange(count), jnp.array(problem.shape)
    kinds = cell_kinds(problem.classes, jax.tree.map(lambda leaf: leaf.reshape(-1, 1, 1), problem.rules))

    def about(ij):
        inside = jnp.all((ij >= 0) & (ij < shape), axis=1)
        i, j = jnp.clip(ij, 0, shape - 1).T
        kind = jnp.where(inside, kinds[row, i, j], FORBIDDEN_KIND).astype(jnp.int8)
        return kind, problem.levels[row, i, j]

    def step(carry, move):
        ij, wrong, ended = carry
        going = (move >= 0) & ~ended
        delta = jnp.asarray(DIRECTIONS)[jnp.clip(move, 0, 7)]
        sides = [about(ij + delta * jnp.array(axis))[0] for axis in ((1, 0), (0, 1))]
        ends = about(ij), about(ij + delta)
        straight = move_kind(*ends, None, problem.rules.corner_cutting)
        diagonal = move_kind(*ends, sides, problem.rules.corner_cutting)
        kind = jnp.where(move % 2 == 1, diagonal, straight)
        wrong = wrong | (going & ((kind == FORBIDDEN_KIND) | (move > 7)))
        ij = jnp.where(going[:, None], ij + delta, ij)
        return (ij.astype(problem.start_ij.dtype), wrong, ended | (move < 0)), None

    none = jnp.zeros(count, bool)
    (_, wrong, _), _ = jax.lax.scan(step, (problem.start_ij, none, none), moves[:, : problem.length].T)
    own = jnp.zeros(count, jnp.int8) if route.fault is None else route.fault.astype(jnp.int8)
    return jnp.where(own != FINE, own, jnp.where(wrong, FAILED, FINE)).astype(jnp.int8)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class StraightLine(Planner):
    """Straight to the goal, cell by cell in the direction that best leads there; stops where that is forbidden.

    The behaviour of a robot without a planner; the strategy `blind_stop` does this without a map.
    """

    def plan(self, problem: Problem) -> Route:
        """See `Planner`."""
        shape, moves = jnp.array(problem.shape), jnp.asarray(DIRECTIONS)
        kinds = cell_kinds(problem.classes, problem.rules)
        ij, ended, directions = problem.start_ij, jnp.zeros((), bool), []

        def about(cell):
            inside = jnp.all((cell >= 0) & (cell < shape))
            i, j = jnp.clip(cell, 0, shape - 1)
            return jnp.where(inside, kinds[i, j], FORBIDDEN_KIND).astype(jnp.int8), problem.levels[i, j]

        for _ in range(problem.length):
            away = (problem.goal_ij - ij).astype(jnp.float32)
            # The move that brings it nearest to the goal; of two equal ones, the first.
            k = jnp.argmin(jnp.hypot(*(away[:, None] - moves.T)))
            sides = [about(ij + moves[k] * jnp.array(axis))[0] for axis in ((1, 0), (0, 1))]
            ends = about(ij), about(ij + moves[k])
            cutting = problem.rules.corner_cutting
            kind = jnp.where(k % 2 == 1, move_kind(*ends, sides, cutting), move_kind(*ends, None, cutting))
            ended = ended | (kind == FORBIDDEN_KIND) | jnp.all(away == 0)
            directions.append(jnp.where(ended, -1, k).astype(jnp.int8))
            ij = jnp.where(ended, ij, ij + moves[k])
        return Route(jnp.stack(directions))
