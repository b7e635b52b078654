"""Planners that are plain functions of NumPy arrays for one map, such as libraries that do not use JAX."""

from __future__ import annotations

import _thread
import sys
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped.core.host_callback import host_call
from jaxbiped.core.time_limit import TimeLimit, within
from jaxbiped.errors import InputError
from jaxbiped.mapping.grid import Cell
from jaxbiped.planning.costs import Costs
from jaxbiped.planning.path_check import PathQuery, check_paths
from jaxbiped.planning.planners import FAILED, FINE, TOO_SLOW, Planner, Problem, Route

MapPlanner = Callable[[np.ndarray, np.ndarray, tuple[int, int], tuple[int, int], Costs], Any]


@jax.tree_util.register_pytree_node_class
@dataclass(frozen=True)
class HostPlanner(Planner):
    """A function that plans on one map, called on the host from inside the compiled loop.

    As a pytree it is an index into the list of all functions: missions of different functions share one program.

    `function(classes, levels, start_ij, goal_ij, costs) -> cells`:

    - `classes` int8 [H, W]: `jaxbiped.Cell` of each cell. Cells that the strategy must not cross are already obstacles.
    - `levels` int8 [H, W]: of the ground; neighbours that differ by more than one are not connected.
    - `start_ij`, `goal_ij`: row and column.
    - `costs`: `Costs` of Eq. 1 on this pitch, plain floats.
    - `cells`: integers [L, 2] from the start to the goal, each a neighbour of the one before, or None if there is no
      path. A diagonal move must not pass a blocked cell, unless `corner_cutting` allows it.

    A function that raises an error, or returns anything else, ends its mission as `planner_failed`, and the first such
    error of a process is reported on stderr; one that takes longer than `limit` ends it as `planner_timeout`. Python
    code is then interrupted; a library's compiled code must return first.
    """

    function: MapPlanner = field(metadata={"static": True})
    limit: float = field(default=10.0, metadata={"static": True})  # [s] for one plan
    number: Any = field(default=None, repr=False, compare=False, metadata={"derived": True})

    def __init_subclass__(cls, **kwargs):
        raise TypeError(
            f"{cls.__name__} cannot extend HostPlanner: give HostPlanner another function, or extend Planner"
        )

    def __post_init__(self):
        if not callable(self.function):
            raise InputError("must be a function", field="HostPlanner", value=self.function)
        try:
            hash(self.function)
        except TypeError:
            raise InputError("its function cannot be hashed", field="HostPlanner") from None
        if not 0 < self.limit < 1e6:
            raise InputError("must be above 0 s", field="HostPlanner: limit", value=self.limit)
        object.__setattr__(self, "number", np.int32(number_of(self.function, self.limit)))

    def tree_flatten(self):
        """Its index."""
        return (self.number,), None

    @classmethod
    def tree_unflatten(cls, _, leaves):
        """From the same index, perhaps traced or of a batch."""
        made = object.__new__(cls)
        for name, value in (("function", None), ("limit", None), ("number", leaves[0])):
            object.__setattr__(made, name, value)
        return made

    def __reduce__(self):
        """Pickle the functions themselves, since their indices belong to one process."""
        if self.function is not None:
            return type(self), (self.function, self.limit)
        known, places = np.unique(np.asarray(self.number), return_inverse=True)
        return numbered, ([FUNCTIONS[k] for k in known], places.reshape(np.shape(self.number)))

    def plan_batch(self, problem: Problem) -> Route:
        """See `Planner`."""
        count, length = problem.start_ij.shape[0], max(problem.length, 3 * sum(problem.shape))
        reals = jax.ShapeDtypeStruct((count,), np.float32)
        whole = jax.ShapeDtypeStruct((count, length), np.int8)
        costs = jnp.stack(jnp.broadcast_arrays(*jax.tree.leaves(problem.costs), reals_like(count))[:-1], axis=-1)
        flags = problem.rules.corner_cutting, problem.rules.bumps, problem.rules.gates
        rules = jnp.stack([jnp.broadcast_to(flag, (count,)) for flag in flags], axis=-1)
        moves, cost, seconds, fault = host_call(
            answer,
            [whole, reals, reals, jax.ShapeDtypeStruct((count,), np.int8)],
            problem.classes.astype(jnp.int8),
            problem.levels.astype(jnp.int8),
            problem.start_ij.astype(jnp.int32),
            problem.goal_ij.astype(jnp.int32),
            costs.astype(jnp.float32),
            rules,
            problem.active,
            jnp.broadcast_to(self.number, (count,)).astype(jnp.int32),
        )
        return Route(moves, None, cost, seconds, fault)


def reals_like(count: int) -> jax.Array:
    """The shape to which numbers of a batch are broadcast."""
    return jnp.zeros(count, jnp.float32)


def numbered(functions: list[tuple[MapPlanner, float]], places: np.ndarray) -> HostPlanner:
    """A batch of planners: the index of each into some functions with their limits."""
    numbers = np.array([number_of(*function) for function in functions], np.int32)
    return HostPlanner.tree_unflatten(None, (numbers[places],))


KNOWN: dict[tuple[MapPlanner, float], int] = {}
FUNCTIONS: list[tuple[MapPlanner, float]] = []  # functions with their limits, by index
LOCK = threading.Lock()


def number_of(function: MapPlanner, limit: float) -> int:
    """Its index in the list of this process."""
    with LOCK:
        known = KNOWN.setdefault((function, limit), len(FUNCTIONS))
        if known == len(FUNCTIONS):
            FUNCTIONS.append((function, limit))
        return known


def answer(classes, levels, start, goal, costs, rules, active, numbers):
    """The routes of a batch, each by the function of its index: moves, costs, seconds and faults."""
    count, length = len(start), 3 * sum(classes.shape[1:])
    seconds, fault = np.zeros(count, np.float32), np.full(count, FINE, np.int8)
    grids = passable(classes, rules)
    given, raised = grids.copy(), levels.copy()  # of which functions may do what they like
    starts, goals, rows = start.tolist(), goal.tolist(), [tuple(row) for row in costs.tolist()]
    own = {row: Costs(*row) for row in set(rows)}
    ways: list[Any] = [None] * count
    for k in np.flatnonzero(active).tolist():
        function, limit = FUNCTIONS[numbers[k]]
        begun = time.perf_counter()
        fault[k], ways[k] = call(
            function, limit, (given[k], raised[k], tuple(starts[k]), tuple(goals[k]), own[rows[k]])
        )
        seconds[k] = time.perf_counter() - begun
    moves, cost, wrong = check_paths(ways, PathQuery(grids, levels, start, goal, costs, rules[:, 0]), length)
    for k, message in wrong.items():
        fault[k] = FAILED
        tell(FUNCTIONS[numbers[k]][0], message)
    return moves, cost, seconds, fault


def call(function: MapPlanner, limit: float, arguments: tuple) -> tuple[int, Any]:
    """The fault of one call with these arguments, and the value returned."""
    try:
        return FINE, within(limit, function, *arguments)
    except TimeLimit:
        return TOO_SLOW, None
    except KeyboardInterrupt:  # from the user, not from the function
        _thread.interrupt_main()
        return FAILED, None
    except BaseException as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        tell(function, f"{type(error).__name__}: {error} ({place.name}, line {place.lineno})")
        return FAILED, None


def passable(classes: np.ndarray, rules: np.ndarray) -> np.ndarray:
    """Copies of maps [B, H, W] on which cells that must not be crossed, by `rules` [B, 3], are obstacles."""
    grids = classes.copy()
    for kind, allowed in ((Cell.BUMP, rules[:, 1]), (Cell.GATE, rules[:, 2])):
        if not allowed.all():
            grids[(grids == kind) & ~allowed[:, None, None]] = Cell.OBSTACLE
    return grids


TOLD: set = set()


def tell(function: MapPlanner, message: str) -> None:
    """Report on stderr what is wrong with a planner, once per process: a study of thousands of missions continues."""
    if function not in TOLD:
        TOLD.add(function)
        name = getattr(function, "__qualname__", type(function).__name__)
        print(f"jaxbiped: warning: planner {name}: {' '.join(message.split())}", file=sys.stderr)
