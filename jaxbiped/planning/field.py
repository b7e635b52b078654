"""Cost-to-go fields rooted at the goal: `cost_to_go` on given edge costs, `field` straight from a class grid."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.errors import InputError
from jaxbiped.planning import kernels, worklist
from jaxbiped.planning.costs import Costs, Rules, half_edges

# Arenas relaxed together, at least and at most, on small and on large grids: what fits the cache, and few enough that
# a slow map holds few others. At least: compilers unroll short loops over the batch and then leave them unvectorised,
# so that a batch is made up with copies, unless there are so FEW that the copies cost more.
LANES, LANES_LARGE, FEW = (80, 128), (32, 32), 16
WIDE = {"xla_cpu_prefer_vector_width": 512}  # bits; the default is half of that
LARGE = 1200  # cells; larger grids are summed in float64 (see `_solve`)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class CostToGo:
    """Least cost from each cell to the goal."""

    cost: Float[Array, "B H W"]  # inf: no way, or not converged
    iterations: Int[Array, "B"]  # rounds of relaxation until nothing changed
    converged: Bool[Array, "B"]  # False: costs that are NaN or negative


def cost_to_go(
    edge_costs: Float[Array | np.ndarray, "B 8 H W"], goal_ij: Int[Array | np.ndarray, "B 2"], method: str = "auto"
) -> CostToGo:
    """Least cost from each cell to `goal_ij` over `edge_costs` (what leaving a cell in each direction costs).

    Args:
      edge_costs: non-negative; zero and inf are allowed. An arena with a NaN or a negative one does not converge.
      goal_ij: row and column; a goal outside the grid is reached from nowhere.
      method: "line_sweep", "wavefront", or "auto" (by platform).
    """
    return _on_all_cores(_cost_to_go, (edge_costs, goal_ij), _method(method))


def field(
    classes: Int[Array | np.ndarray, "B H W"],
    levels: Int[Array | np.ndarray, "B H W"],
    costs: Costs | None = None,
    rules: Rules | None = None,
    goal_ij: Int[Array | np.ndarray, "B 2"] | None = None,
    method: str = "auto",
) -> CostToGo:
    """`cost_to_go` of `edge_costs`, without ever holding all edge costs: the fast path.

    Arguments as there. May be called inside jit, where its chunks run one after the other; called from outside
    on a CPU they go to all cores. An arena's result does not depend on the others of its batch.
    """
    if goal_ij is None:
        raise InputError("must be given", field="goal_ij")
    each = jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, classes.shape[:1]), (costs or Costs(), rules or Rules()))
    return _on_all_cores(_field, (classes, levels, each, goal_ij), _method(method))


@partial(jax.jit, static_argnums=(1, 2))
def _cost_to_go(inputs, method: str, alone: bool) -> CostToGo:
    def chunk(edges, goal):
        valid = (edges >= 0).all((1, 2, 3))  # False for NaN as well
        edges = jnp.where(valid[:, None, None, None], edges, jnp.inf)
        last = jnp.pad(jnp.moveaxis(edges, 0, -1), ((0, 0), (1, 1), (1, 1), (0, 0)), constant_values=jnp.inf)
        return _solve(tuple(last), goal, method, valid, alone)

    return _by_chunks(_whole(chunk, method, alone), inputs, _is_large(inputs[0]))


@partial(jax.jit, static_argnums=(1, 2))
def _field(inputs, method: str, alone: bool) -> CostToGo:
    def chunk(classes, levels, each, goal):
        costs, rules = each
        last = (jnp.moveaxis(a, 0, -1) for a in (classes, levels))
        valid = jnp.stack([c >= 0 for c in jax.tree.leaves(costs)]).all(0)
        costs = jax.tree.map(lambda c: jnp.where(valid, c, jnp.inf), costs)
        return _solve(half_edges(*last, costs, rules), goal, method, valid, alone)

    return _by_chunks(_whole(chunk, method, alone), inputs, _is_large(inputs[0]))


def _whole(chunk, method: str, alone: bool):
    """All of a chunk's work as one function where the kernel is one: no core then waits for another.

    Only in a program of its own. Within a larger one, where XLA may fuse the function with what comes before it (and
    then fails to compile), each sweep is a function by itself: see `_solve`.
    """
    return kernels.one_function(chunk) if method == "line_sweep" and alone else chunk


def _method(name: str) -> str:
    if name not in ("auto", *kernels.METHODS):
        raise InputError(f"must be one of auto, {', '.join(kernels.METHODS)}", field="method", value=name)
    return kernels.default_method() if name == "auto" else name


def _on_all_cores(solve, inputs, method: str) -> CostToGo:
    """`solve` on pieces of one chunk each, from as many threads as there are cores, if that is any use.

    Loops of this kind are serial inside a program on a CPU; programs of several threads do run side by side.
    """
    batch, most = inputs[0].shape[0], (LANES_LARGE if _is_large(inputs[0]) else LANES)[1]
    traced = any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(inputs))
    if not traced and jax.default_backend() == "cpu":
        solve = _widened(solve)
    if traced or batch <= most or jax.default_backend() != "cpu":
        return solve(jax.tree.map(jnp.asarray, inputs), method, not traced)
    inputs = jax.tree.map(np.asarray, inputs)
    out = CostToGo(
        _aligned(inputs[0].shape[:1] + inputs[0].shape[-2:]), np.empty(batch, np.int32), np.empty(batch, bool)
    )

    def piece(start):
        stop = min(start + most, batch)
        part = jax.tree.map(lambda a: a[max(stop - most, 0) : stop], inputs)  # the last one overlaps: one program
        found = solve(part, method, True)
        jax.tree.map(lambda whole, a: np.copyto(whole[start:stop], np.asarray(a)[start - stop :]), out, found)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(piece, range(0, batch, most)))
    return jax.tree.map(jnp.asarray, out)


@cache
def _widened(solve):
    """`solve` with the widest vectors, a tenth faster on small grids; as it is where a compiler has no such option."""
    try:
        jax.jit(jnp.negative, compiler_options=WIDE).lower(0.0).compile()
    except jax.errors.JaxRuntimeError:
        return solve
    return jax.jit(solve, static_argnums=(1, 2), compiler_options=WIDE)


def _aligned(shape) -> Float[np.ndarray, "..."]:
    """Room for float32 that JAX takes over as it is instead of copying it."""
    size = 4 * int(np.prod(shape))
    room = np.empty(size + 64, np.uint8)
    start = -room.ctypes.data % 64
    return room[start : start + size].view(np.float32).reshape(shape)


def _is_large(grids) -> bool:
    return grids.shape[-2] * grids.shape[-1] > LARGE


def _solve(edges, goal_ij, method, valid, alone) -> CostToGo:
    # Sums along a path drift by up to half a unit in the last place a move: with float32 a path through a
    # large maze is off by more than 1e-5, so the kernels alone are then float64, in any program.
    large = _is_large(edges[0][1:-1, 1:-1, 0])
    with jax.enable_x64(large):
        state = kernels.beginning(edges, goal_ij, jnp.float64 if large else jnp.float32)
        if large and method == "line_sweep" and goal_ij.shape[0] == 1:
            cost, steps, converged = worklist.settle(edges, state)
        else:
            relax = kernels.METHODS[method]
            relax = kernels.one_function(relax) if method == "line_sweep" and not alone else relax
            cost, steps, converged = kernels.settle(relax, edges, state)
        cost, steps = jnp.moveaxis(cost[1:-1, 1:-1].astype(jnp.float32), -1, 0), steps.astype(jnp.int32)
    converged &= valid
    return CostToGo(jnp.where(converged[:, None, None], cost, jnp.inf), steps, converged)


def _by_chunks(solve, inputs, large):
    """`solve(*inputs)` in chunks of the leading axis, one after the other, each stopping by itself."""
    batch = inputs[0].shape[0]
    if batch == 0:
        grid = inputs[0].shape[-2:]
        return CostToGo(jnp.zeros((0, *grid)), jnp.zeros(0, jnp.int32), jnp.zeros(0, bool))
    least, most = LANES_LARGE if large else LANES
    if batch < FEW:
        chunks, size = (batch, 1) if large else (1, batch)
    else:
        chunks = -(-batch // most)
        size = max(-(-batch // chunks), least)
    pad = chunks * size - batch
    parts = jax.tree.map(lambda a: jnp.pad(a, ((0, pad),) + ((0, 0),) * (a.ndim - 1), mode="edge"), inputs)
    if chunks == 1:
        out = solve(*parts)
    else:
        parts = jax.tree.map(lambda a: a.reshape(chunks, size, *a.shape[1:]), parts)
        out = lax.map(lambda part: solve(*part), parts)
        out = jax.tree.map(lambda a: a.reshape(chunks * size, *a.shape[2:]), out)
    return jax.tree.map(lambda a: a[:batch], out)
