"""Cost-to-go fields rooted at the goal: `cost_to_go` from given edge costs, `field` directly from a class grid."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.core.batching import fold, folding_vmap, unfold, without_gradient
from jaxbiped.core.checks import cells, leading_shape, reals
from jaxbiped.core.program_cache import keep_programs
from jaxbiped.core.ready_programs import ready_jit
from jaxbiped.devices import by_rows, cores, mesh_of
from jaxbiped.errors import InputError
from jaxbiped.planning import kernels, wavefront
from jaxbiped.planning.arguments import are_classes, grid_arguments
from jaxbiped.planning.costs import Costs, Rules, half_edges, tables

keep_programs()
METHODS = ("wavefront", *kernels.METHODS)
CHUNK = kernels.LANES  # arenas solved together: as many as fit in the cache
PIECES = 4  # pieces per core, so that a slow piece does not leave the other cores idle
LARGE, FEW = 1200, 4  # cells of a large grid; fewer of these at once are solved one by one,
HUGE = 1 << 17  # like grids of more cells than this, in any number
NO_GRADIENT = "a field has no gradient: differentiate `planning.path_cost`, the cost of the best path from a start"


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class CostToGo:
    """Lowest cost from each cell to the goal."""

    cost: Float[Array, "*B H W"]  # inf: no path, or not converged
    iterations: Int[Array, "*B"]  # rounds of relaxation until nothing changed; 1 with "dijkstra"
    converged: Bool[Array, "*B"]  # whether the costs are exact: one more relaxation, which is done, lowers none


def cost_to_go(edge_costs: Any, goal_ij: Any, method: str = "auto") -> CostToGo:
    """Lowest cost from each cell to `goal_ij` over `edge_costs` (the cost of leaving a cell in each direction).

    Leading axes broadcast. May be called inside `jit`, `vmap` and `scan`. There is no gradient (see `path_cost`).

    Args:
      edge_costs: [*B, 8, H, W], float32; zero and inf are allowed. An arena with a NaN or a negative cost does not
        converge, and its costs are inf. Moves out of the grid are never made, whatever their cost.
      goal_ij: [*B, 2], integers, row and column; a goal outside the grid cannot be reached.
      method: "wavefront" (any device), "line_sweep" or "dijkstra" (CPU), or "auto": line sweeps on a CPU, but Dijkstra
        for huge grids and for few large ones, and the wavefront on other devices.

    Raises:
      InputError: an argument of another rank, shape or dtype; a method that this device does not have.
    """
    edges, goal_ij = reals("edge_costs", edge_costs, "8 H W"), cells("goal_ij", goal_ij)
    batch = leading_shape(edge_costs=(edges, "8 H W"), goal_ij=(goal_ij, "2"))
    inputs = fold(edges, batch, 3), fold(goal_ij, batch, 1)
    return unfold(_on_all_cores(_cost_to_go, inputs, _method(method, inputs[0])), batch)


def field(
    classes: Any,
    levels: Any,
    costs: Costs | None = None,
    rules: Rules | None = None,
    goal_ij: Any = None,
    method: str = "auto",
    devices: Sequence[jax.Device] | None = None,
) -> CostToGo:
    """`cost_to_go` of `edge_costs` without holding all edge costs at once: the fast path.

    Leading axes broadcast. May be called inside `jit`, `vmap` and `scan`, where its chunks run one after another;
    called from outside on a CPU it uses all cores. An arena's result does not depend on the others of its batch.
    There is no gradient (see `path_cost`).

    Args:
      classes: [*B, H, W], integers, one `Cell` each. Traced grids with another value do not converge: their costs are
        inf.
      levels: [*B, H, W], integers, height of each cell's ground in steps, from -128 to 127; not read for unmeasured
        cells and obstacles. Traced grids with a level out of range do not converge.
      costs, rules: leaves [*B]; the paper's by default. An arena with a cost that is NaN or negative does not converge.
      goal_ij: [*B, 2], integers, row and column; a goal outside the grid cannot be reached.
      method: as for `cost_to_go`.
      devices: called from outside, they share the batch; by default all of this process unless they are CPUs.

    Raises:
      InputError: an argument of another rank, shape or dtype, or a value out of range where values are concrete; a
        method that this device does not have.
    """
    if goal_ij is None:
        raise InputError("must be given", field="goal_ij")
    given = grid_arguments(classes, levels, costs or Costs(), rules or Rules(), goal_ij=goal_ij)
    batch, (classes, levels, costs, rules, goal_ij) = given
    inputs = classes, levels, (costs, rules), goal_ij
    return unfold(_on_all_cores(_field, inputs, _method(method, classes), devices), batch)


@cache
def _differentiated(solve, method: str):
    """`solve(inputs, method)` as a function of `inputs` that supports `vmap` and `grad`."""
    return without_gradient(folding_vmap(lambda inputs: solve(inputs, method)), NO_GRADIENT)


@ready_jit(static_argnames=("method",))
def _cost_to_go(inputs, method: str) -> CostToGo:
    def chunk(edges, goal):
        valid = (edges >= 0).all((1, 2, 3))  # False for NaN as well
        edges = jnp.where(valid[:, None, None, None], edges, jnp.inf)
        last = jnp.pad(jnp.moveaxis(edges, 0, -1), ((0, 0), (1, 1), (1, 1), (0, 0)), constant_values=jnp.inf)
        return _solve(tuple(last), goal, method, valid)

    return _by_chunks(chunk, inputs)


@ready_jit(static_argnames=("method",))
def _field(inputs, method: str) -> CostToGo:
    if method != "wavefront":
        return _from_grids(*inputs, method)

    def chunk(classes, levels, each, goal):
        costs, rules = each
        costs, valid = _checked(costs)
        last = (jnp.moveaxis(a, 0, -1) for a in (classes, levels))
        return _solve(half_edges(*last, costs, rules), goal, method, valid & are_classes(classes))

    return _by_chunks(chunk, inputs)


def _from_grids(classes, levels, each, goal_ij, method: str) -> CostToGo:
    """Kernels that compute edge costs themselves: line sweeps for a few arenas at a time, and Dijkstra's method."""
    solve = kernels.solve_grids if method == "line_sweep" else kernels.solve_maps
    read, valid = valid_tables(each)
    valid &= are_classes(classes)
    goal_ij = jnp.where(valid[:, None], goal_ij, -1)
    with jax.enable_x64(True):
        cost, steps, settled = solve(read, classes, levels, goal_ij)
        return CostToGo(cost, steps, valid & settled)


@jax.jit
def valid_tables(each):
    """`tables` of costs and rules, and which costs are valid."""
    costs, valid = _checked(each[0])
    return tables(costs, each[1]), valid


def _checked(costs: Costs):
    """The costs if they are valid, else inf; and whether they are."""
    valid = jnp.stack([c >= 0 for c in jax.tree.leaves(costs)]).all(0)  # False for NaN as well
    return jax.tree.map(lambda c: jnp.where(valid, c, jnp.inf), costs), valid


def _method(name: str, grids) -> str:
    on_cpu = jax.default_backend() == "cpu"
    allowed = METHODS if on_cpu else ("wavefront",)
    if name not in ("auto", *allowed):
        raise InputError(
            f"must be one of auto, {', '.join(allowed)} on this device ({jax.default_backend()})",
            field="method",
            value=name,
        )
    if name != "auto":
        return name
    if not on_cpu:
        return "wavefront"
    size = grids.shape[-2] * grids.shape[-1]
    return "dijkstra" if size > HUGE or (size > LARGE and grids.shape[0] < FEW) else "line_sweep"


def _on_all_cores(solve, inputs, method: str, devices=None) -> CostToGo:
    """`solve` on pieces of the batch: on devices, or in as many threads as a CPU has cores, if that helps."""
    batch, grid = inputs[0].shape[0], inputs[0].shape[-2:]
    if batch * math.prod(grid) == 0:
        return CostToGo(jnp.zeros((batch, *grid)), jnp.zeros(batch, jnp.int32), jnp.ones(batch, bool))
    traced = any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(inputs))
    if not traced and devices is None and jax.default_backend() != "cpu" and jax.local_device_count() > 1:
        devices = jax.local_devices()
    if devices and not traced:
        return by_rows(solve, mesh_of(devices), method=method)(inputs)
    if traced:
        return _differentiated(solve, method)(jax.tree.map(jnp.asarray, inputs))
    dijkstra = solve is _field and method == "dijkstra"  # one map after the other: any number is a piece
    if (batch <= CHUNK and not dijkstra) or jax.default_backend() != "cpu":
        return solve(jax.tree.map(jnp.asarray, inputs), method)
    least = 1 if dijkstra else CHUNK
    size = min(batch, least * -(-batch // (least * PIECES * cores())))
    out = CostToGo(kernels.aligned((batch, *grid), np.float32), np.empty(batch, np.int32), np.empty(batch, bool))
    direct = dijkstra or (solve is _field and method == "line_sweep")
    inputs, valid = _prepared(inputs) if direct else (jax.tree.map(np.asarray, inputs), True)

    def piece(start):
        stop = min(start + size, batch)
        rows = slice(stop - size, stop)  # the last piece overlaps the one before: one program
        part = jax.tree.map(lambda a: a[rows], inputs)
        if direct:
            kernels.solve_arrays(method, *part, out.cost[rows], out.iterations[rows], out.converged[rows])
        else:
            jax.tree.map(lambda whole, a: np.copyto(whole[rows], a), out, solve(part, method))

    if batch <= size:
        piece(0)
    else:
        with ThreadPoolExecutor(cores()) as pool:
            list(pool.map(piece, range(0, batch, size)))
    out.converged[:] &= valid
    return jax.device_put(out)  # adopts arrays without a copy, unlike `jnp.asarray`


def _prepared(inputs):
    """Arguments of `kernels.solve_arrays`, except its results; and which arenas are valid."""
    classes, levels, each, goal_ij = inputs
    read, valid = valid_tables(each)
    valid = np.asarray(valid)
    goal_ij = np.where(valid[:, None], goal_ij, np.int32(-1))
    grids = (np.ascontiguousarray(a) for a in (classes, levels))
    return (jax.tree.map(np.asarray, read), *grids, goal_ij), valid


def _solve(edges, goal_ij, method: str, valid) -> CostToGo:
    # Sums along a path drift by up to half a unit in the last place per move: as float32, a path of 1000 moves has
    # an error above 1e-5. So sums are float64, in any program.
    goal_ij = jnp.where(valid[:, None], goal_ij, -1)  # from where nothing can be reached
    with jax.enable_x64(True):
        if method == "wavefront":
            cost, steps, settled = wavefront.solve_edges(edges, goal_ij)
        else:
            cost, steps, settled = kernels.solve_edges(edges, goal_ij, method)
        return CostToGo(cost, steps.astype(jnp.int32), valid & settled)


def _by_chunks(solve, inputs) -> CostToGo:
    """`solve(*inputs)` in chunks of the leading axis, one after another."""
    batch = inputs[0].shape[0]
    if batch <= CHUNK:
        return solve(*inputs)
    chunks = -(-batch // CHUNK)
    pad = chunks * CHUNK - batch
    parts = jax.tree.map(lambda a: jnp.pad(a, ((0, pad),) + ((0, 0),) * (a.ndim - 1), mode="edge"), inputs)
    parts = jax.tree.map(lambda a: a.reshape(chunks, CHUNK, *a.shape[1:]), parts)
    out = lax.map(lambda part: solve(*part), parts)
    return jax.tree.map(lambda a: a.reshape(chunks * CHUNK, *a.shape[2:])[:batch], out)
