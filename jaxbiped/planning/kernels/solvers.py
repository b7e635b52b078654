"""The compiled planners as functions of JAX arrays, on a CPU: `line_sweep` and `dijkstra`."""

from __future__ import annotations

from functools import cache
from threading import Lock

import jax
import jax.numpy as jnp
import numpy as np
from numba import carray, njit

from jaxbiped.core import xla_ffi
from jaxbiped.core.ready_programs import TARGETS
from jaxbiped.planning.kernels import dijkstra, grids, line_sweep, map_astar, map_dijkstra
from jaxbiped.planning.kernels.line_sweep import LANES
from jaxbiped.planning.kernels.names import METHODS as METHODS


@njit
def edge(arguments, k, size):
    """Edge costs number `k` of the arguments, flat."""
    return xla_ffi.array(arguments, k, size, np.float32)


def solver(solve_lanes, lanes: int):
    """`solve_lanes` for all arenas of a batch, `lanes` at a time, as `xla_ffi.register` wants it."""
    unsettled = line_sweep.proof(lanes)

    @njit
    def solve(arguments, count, results):
        dims = xla_ffi.shape(arguments, 0)
        height, width, batch = np.int64(dims[0]) - 2, np.int64(dims[1]) - 2, np.int64(dims[2])
        size = (height + 2) * (width + 2) * batch
        half = count == 5  # four kinds of edges and the goals
        b = 0 if half else 4
        edges = (
            edge(arguments, 0, size), edge(arguments, 1, size), edge(arguments, 2, size), edge(arguments, 3, size),
            edge(arguments, b, size), edge(arguments, b + 1, size), edge(arguments, b + 2, size),
            edge(arguments, b + 3, size),
        )  # fmt: skip
        goals = carray(xla_ffi.pointer(xla_ffi.data(arguments, count - 1)), (batch, 2), np.int32)
        field = carray(xla_ffi.pointer(xla_ffi.data(results, 0)), (batch, height, width), np.float32)
        steps = carray(xla_ffi.pointer(xla_ffi.data(results, 1)), (batch,), np.int32)
        settled = carray(xla_ffi.pointer(xla_ffi.data(results, 2)), (batch,), np.bool_)
        cost = carray(xla_ffi.pointer(xla_ffi.data(results, 3)), (size,), np.float64)
        cost[:] = np.inf
        for arena in range(batch):
            i, j = goals[arena]
            if 0 <= i < height and 0 <= j < width:
                cost[((i + 1) * (width + 2) + j + 1) * batch + arena] = 0.0
        for first in range(0, batch - lanes + 1, lanes):
            steps[first : first + lanes] = solve_lanes(edges, goals, cost, first, height, width, batch, half)
            for i in range(height):
                for arena in range(first, first + lanes):
                    row = ((i + 1) * (width + 2) + 1) * batch + arena
                    for j in range(width):
                        field[arena, i, j] = cost[row + j * batch]
            wrong = unsettled(edges, cost, first, height, width, batch, half)
            for lane in range(lanes):
                settled[first + lane] = (wrong >> np.uint64(lane)) & np.uint64(1) == 0

    return solve


LINE = 64  # [bytes] of the cache
GRIDS, MAPS = "grids", "maps"  # straight from grids: line sweeps, and Dijkstra


READ, SEARCH = "read", "search"  # one map, and paths on it
WHOLE = {GRIDS: grids.solver, MAPS: map_dijkstra.solver, READ: map_astar.reader, SEARCH: map_astar.searcher}


def target(kernel: str) -> tuple[str, int]:
    """`registered`, by one thread at a time: XLA holds the address of what was registered first."""
    with LOCK:
        return registered(kernel)


LOCK = Lock()


@cache
def registered(kernel: str) -> tuple[str, int]:
    """The name by which XLA knows a kernel, and its lanes; compiled at the first call."""
    name, lanes = f"jaxbiped_{kernel}", 1 if kernel == "dijkstra" else LANES
    TARGETS[name] = __name__, (kernel,)
    if kernel in WHOLE:
        xla_ffi.register(name, WHOLE[kernel](), keep=True)
    else:
        solve_lanes = dijkstra.solve_arena if kernel == "dijkstra" else line_sweep.sweeps(lanes)
        xla_ffi.register(name, solver(solve_lanes, lanes), keep=True)
    return name, lanes


def solve_edges(edges, goal_ij, method: str):
    """(cost [B, H, W] float32, steps until nothing changed [B], whether it is settled [B]), summed as float64.

    Args:
      edges: tuple of eight float32 arrays [H + 2, W + 2, B] with a ring of inf, the costs of leaving a cell in each of
        `DIRECTIONS`, or of the first four where a move costs what the move back costs; none may be NaN or negative.
      goal_ij: [B, 2]; nothing is reached from one outside the grid.
    """
    name, lanes = target(method)
    height, width, batch = edges[0].shape
    for e in edges:
        xla_ffi.expect(e, (height, width, batch), np.float32)
    xla_ffi.expect(goal_ij, (batch, 2), np.int32)
    many = -(-batch // lanes) * lanes
    edges = [jnp.pad(e, ((0, 0), (0, 0), (0, many - batch)), constant_values=jnp.inf) for e in edges]
    goal_ij = jnp.pad(goal_ij, ((0, many - batch), (0, 0)), constant_values=-1)
    results = (
        jax.ShapeDtypeStruct((many, height - 2, width - 2), jnp.float32),
        jax.ShapeDtypeStruct((many,), jnp.int32),
        jax.ShapeDtypeStruct((many,), jnp.bool_),
        jax.ShapeDtypeStruct((height, width, many), jnp.float64),  # room to work in
    )
    cost, steps, settled, _ = jax.ffi.ffi_call(name, results)(*edges, goal_ij)
    return cost[:batch], steps[:batch], settled[:batch]


def solve_grids(tables, classes, levels, goal_ij):
    """`solve_edges` by line sweeps, straight from grids, without ever holding the edges of more than a few arenas.

    Args:
      tables: of each arena: the kind of a cell of each class, int8 [B, 5]; what moves of each kind cost, straight and
        diagonal, float32 [B, 2, KINDS], none NaN or negative; whether corners may be cut, int8 [B].
      classes, levels: int8 [B, H, W]; a cell of no class is an obstacle.
    """
    name, lanes = target(GRIDS)
    batch, height, width = classes.shape
    inputs = (classes, levels, *tables, goal_ij)
    for array, (shape, dtype) in zip(inputs, grids.layout(batch, height, width), strict=True):
        xla_ffi.expect(array, shape, dtype)
    if batch < lanes:
        inputs = [jnp.pad(a, ((0, lanes - batch),) + ((0, 0),) * (a.ndim - 1)) for a in inputs]
    many = max(batch, lanes)
    cost, steps, settled, *_ = jax.ffi.ffi_call(name, results_of(many, height, width, grids.rooms))(*inputs)
    return cost[:batch], steps[:batch], settled[:batch]


def results_of(batch: int, height: int, width: int, rooms) -> tuple[jax.ShapeDtypeStruct, ...]:
    """What a kernel that reads grids returns: costs, steps, whether they are exact, and its room to work in."""
    return (
        jax.ShapeDtypeStruct((batch, height, width), jnp.float32),
        jax.ShapeDtypeStruct((batch,), jnp.int32),
        jax.ShapeDtypeStruct((batch,), jnp.bool_),
        *(jax.ShapeDtypeStruct((size,), dtype) for size, dtype in rooms(height, width)),
    )


def solve_maps(tables, classes, levels, goal_ij):
    """`solve_grids` by Dijkstra's method, one map after the other: arguments and results of any batch."""
    name, _ = target(MAPS)
    batch, height, width = classes.shape
    inputs = (classes, levels, *tables, goal_ij)
    for array, (shape, dtype) in zip(inputs, grids.layout(batch, height, width), strict=True):
        xla_ffi.expect(array, shape, dtype)
    cost, steps, settled, *_ = jax.ffi.ffi_call(name, results_of(batch, height, width, map_dijkstra.rooms))(*inputs)
    return cost, steps, settled


def solve_arrays(method: str, tables, classes, levels, goal_ij, cost, steps, settled) -> None:
    """`solve_grids` or `solve_maps` of NumPy arrays; results go into `cost`, `steps` and `settled`.

    From other threads it runs at the same time. Line sweeps need as many arenas as they have lanes.
    """
    kernel, (batch, height, width) = GRIDS if method == "line_sweep" else MAPS, classes.shape
    inputs = (classes, levels, *tables, goal_ij)
    results = ((cost, classes.shape, np.float32), (steps, (batch,), np.int32), (settled, (batch,), np.bool_))
    for array, (shape, dtype) in zip(inputs, grids.layout(batch, height, width), strict=True):
        xla_ffi.expect(array, shape, dtype)
    for array, shape, dtype in results:
        xla_ffi.expect(array, shape, dtype)
    least = LANES if kernel == GRIDS else 1
    if batch < least or not all(array.flags.c_contiguous for array in (*inputs, cost, steps, settled)):
        raise ValueError(f"needs at least {least} arenas, in contiguous arrays")
    rooms = grids.rooms(height, width) if kernel == GRIDS else map_dijkstra.rooms(height, width)
    name, _ = target(kernel)
    xla_ffi.call(name, inputs, (cost, steps, settled, *(aligned(size, dtype) for size, dtype in rooms)))


def aligned(shape, dtype) -> np.ndarray:
    """An array, not filled, where vectors do not straddle lines of the cache; JAX takes it over without a copy."""
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    room = np.empty(size + LINE, np.uint8)
    start = -room.ctypes.data % LINE
    return room[start : start + size].view(dtype).reshape(shape)
