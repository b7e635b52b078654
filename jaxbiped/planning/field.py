"""Cost-to-go fields rooted at the goal: `cost_to_go` on given edge costs, `field` straight from a class grid."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.devices import by_rows, mesh_of
from jaxbiped.errors import InputError
from jaxbiped.planning import compiled, wavefront
from jaxbiped.planning.costs import Costs, Rules, half_edges, tables

METHODS = ("wavefront", *compiled.METHODS)
# arenas settled together, of small and of large grids: what fits the cache
CHUNK, CHUNK_LARGE = compiled.LANES, compiled.LANES_LARGE
PIECES = 4  # for each core, so that a slow piece does not leave the other cores idle
LARGE = 1200  # cells; larger grids are summed in float64 (see `_solve`)
HUGE, FEW = 1 << 17, 4  # cells from which on, and large grids at once below which, cells are settled one by one


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class CostToGo:
    """Least cost from each cell to the goal."""

    cost: Float[Array, "B H W"]  # inf: no way, or not converged
    iterations: Int[Array, "B"]  # rounds of relaxation until nothing changed; 1 with "dijkstra"
    converged: Bool[Array, "B"]  # False: costs that are NaN or negative


def cost_to_go(
    edge_costs: Float[Array | np.ndarray, "B 8 H W"], goal_ij: Int[Array | np.ndarray, "B 2"], method: str = "auto"
) -> CostToGo:
    """Least cost from each cell to `goal_ij` over `edge_costs` (what leaving a cell in each direction costs).

    Args:
      edge_costs: non-negative; zero and inf are allowed. An arena with a NaN or a negative one does not converge.
      goal_ij: row and column; a goal outside the grid is reached from nowhere.
      method: "wavefront" (any device), "line_sweep" or "dijkstra" (CPU), or "auto": line sweeps on a CPU, Dijkstra
        there for huge grids and for few large ones, the wavefront elsewhere.
    """
    return _on_all_cores(_cost_to_go, (edge_costs, goal_ij), _method(method, edge_costs))


def field(
    classes: Int[Array | np.ndarray, "B H W"],
    levels: Int[Array | np.ndarray, "B H W"],
    costs: Costs | None = None,
    rules: Rules | None = None,
    goal_ij: Int[Array | np.ndarray, "B 2"] | None = None,
    method: str = "auto",
    devices: Sequence[jax.Device] | None = None,
) -> CostToGo:
    """`cost_to_go` of `edge_costs`, without ever holding all edge costs: the fast path.

    Arguments as there. May be called inside jit, where its chunks run one after the other; called from outside
    on a CPU they go to all cores. An arena's result does not depend on the others of its batch.

    Args:
      devices: called from outside, they share the batch; by default all of this process where they are no CPU.
    """
    if goal_ij is None:
        raise InputError("must be given", field="goal_ij")
    each = jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, classes.shape[:1]), (costs or Costs(), rules or Rules()))
    return _on_all_cores(_field, (classes, levels, each, goal_ij), _method(method, classes), devices)


@partial(jax.jit, static_argnums=1)
def _cost_to_go(inputs, method: str) -> CostToGo:
    def chunk(edges, goal):
        valid = (edges >= 0).all((1, 2, 3))  # False for NaN as well
        edges = jnp.where(valid[:, None, None, None], edges, jnp.inf)
        last = jnp.pad(jnp.moveaxis(edges, 0, -1), ((0, 0), (1, 1), (1, 1), (0, 0)), constant_values=jnp.inf)
        return _solve(tuple(last), goal, method, valid)

    return _by_chunks(chunk, inputs, _is_large(inputs[0]))


@partial(jax.jit, static_argnums=1)
def _field(inputs, method: str) -> CostToGo:
    if method == "line_sweep":
        return _from_grids(*inputs)

    def chunk(classes, levels, each, goal):
        costs, rules = each
        costs, valid = _checked(costs)
        last = (jnp.moveaxis(a, 0, -1) for a in (classes, levels))
        return _solve(half_edges(*last, costs, rules), goal, method, valid)

    return _by_chunks(chunk, inputs, _is_large(inputs[0]))


def _from_grids(classes, levels, each, goal_ij) -> CostToGo:
    """Line sweeps, for which the kernel itself prices the edges of a few arenas at a time."""
    read, valid = _tables(each)
    goal_ij, double = jnp.where(valid[:, None], goal_ij, -1), _is_large(classes)
    with jax.enable_x64(double):
        cost, steps = compiled.settle_grids(read, _bytes(classes), _bytes(levels), goal_ij, double)
        return CostToGo(cost, steps, valid)


@jax.jit
def _tables(each):
    """`tables` of costs and rules, and which costs are valid."""
    costs, valid = _checked(each[0])
    return tables(costs, each[1]), valid


def _bytes(grids):
    """Classes or levels as int8; those beyond it are taken for its ends."""
    return grids if grids.dtype == np.int8 else grids.clip(-128, 127).astype(np.int8)


def _checked(costs: Costs):
    """The costs, where they are valid, else inf; and whether they are."""
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
    cells = grids.shape[-2] * grids.shape[-1]
    return "dijkstra" if cells > HUGE or (_is_large(grids) and grids.shape[0] < FEW) else "line_sweep"


def _on_all_cores(solve, inputs, method: str, devices=None) -> CostToGo:
    """`solve` on pieces of the batch: on devices, or from as many threads as a CPU has cores, if that is any use."""
    batch, chunk = inputs[0].shape[0], CHUNK_LARGE if _is_large(inputs[0]) else CHUNK
    traced = any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(inputs))
    if not traced and devices is None and jax.default_backend() != "cpu" and jax.local_device_count() > 1:
        devices = jax.local_devices()
    if devices and not traced and batch:
        return by_rows(solve, mesh_of(devices), method=method)(inputs)
    if traced or batch <= chunk or jax.default_backend() != "cpu":
        return solve(jax.tree.map(jnp.asarray, inputs), method)
    size = min(batch, chunk * -(-batch // (chunk * PIECES * (os.cpu_count() or 1))))
    shape = inputs[0].shape[:1] + inputs[0].shape[-2:]
    out = CostToGo(compiled.aligned(shape, np.float32), np.empty(batch, np.int32), np.empty(batch, bool))
    direct = solve is _field and method == "line_sweep"
    inputs = _prepared(inputs, out) if direct else jax.tree.map(np.asarray, inputs)

    def piece(start):
        stop = min(start + size, batch)
        rows = slice(stop - size, stop)  # the last one overlaps the one before: one program
        part = jax.tree.map(lambda a: a[rows], inputs)
        if direct:
            compiled.settle_arrays(*part, out.cost[rows], out.iterations[rows], _is_large(out.cost))
        else:
            jax.tree.map(lambda whole, a: np.copyto(whole[rows], a), out, solve(part, method))

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(piece, range(0, batch, size)))
    return jax.device_put(out)  # which takes arrays over as they are, where `jnp.asarray` copies


def _prepared(inputs, out: CostToGo):
    """Arguments of `compiled.settle_arrays`, all but its results; says in `out` which arenas are valid."""
    classes, levels, each, goal_ij = inputs
    read, out.converged[:] = _tables(each)
    goal_ij = np.where(out.converged[:, None], goal_ij, -1).astype(np.int32)
    grids = (np.ascontiguousarray(_bytes(np.asarray(a))) for a in (classes, levels))
    return jax.tree.map(np.asarray, read), *grids, goal_ij


def _is_large(grids) -> bool:
    return grids.shape[-2] * grids.shape[-1] > LARGE


def _solve(edges, goal_ij, method: str, valid) -> CostToGo:
    # Sums along a path drift by up to half a unit in the last place a move: with float32 a path through a
    # large maze is off by more than 1e-5, so large grids are summed in float64, in any program.
    double = method == "dijkstra" or _is_large(edges[0][1:-1, 1:-1, 0])
    goal_ij = jnp.where(valid[:, None], goal_ij, -1)  # from where nothing is reached
    with jax.enable_x64(double):
        if method == "wavefront":
            cost, steps = wavefront.settle(edges, goal_ij, double)
        else:
            cost, steps = compiled.settle(edges, goal_ij, method, double)
        return CostToGo(cost, steps.astype(jnp.int32), valid)


def _by_chunks(solve, inputs, large: bool) -> CostToGo:
    """`solve(*inputs)` in chunks of the leading axis, one after the other."""
    batch, size = inputs[0].shape[0], CHUNK_LARGE if large else CHUNK
    if batch == 0:
        return CostToGo(jnp.zeros((0, *inputs[0].shape[-2:])), jnp.zeros(0, jnp.int32), jnp.zeros(0, bool))
    if batch <= size:
        return solve(*inputs)
    chunks = -(-batch // size)
    pad = chunks * size - batch
    parts = jax.tree.map(lambda a: jnp.pad(a, ((0, pad),) + ((0, 0),) * (a.ndim - 1), mode="edge"), inputs)
    parts = jax.tree.map(lambda a: a.reshape(chunks, size, *a.shape[1:]), parts)
    out = lax.map(lambda part: solve(*part), parts)
    return jax.tree.map(lambda a: a.reshape(chunks * size, *a.shape[2:])[:batch], out)
