"""Cost-to-go fields rooted at the goal: `cost_to_go` on given edge costs, `field` straight from a class grid."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.errors import InputError
from jaxbiped.planning import kernels, worklist
from jaxbiped.planning.costs import Costs, Rules, half_edges

CHUNK = 128  # arenas relaxed together at most: what fits the cache, and few enough that a slow map holds few others
LANES = 80  # and at least, made up with copies: compilers unroll loops of up to 64 and then leave them unvectorised
FEW = 16  # below this many the copies cost more than they save
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
    edges, goal_ij = jnp.asarray(edge_costs), jnp.asarray(goal_ij)

    def chunk(edges, goal):
        valid = (edges >= 0).all((1, 2, 3))
        edges = jnp.where(valid[:, None, None, None], edges, jnp.inf)
        last = jnp.pad(jnp.moveaxis(edges, 0, -1), ((0, 0), (1, 1), (1, 1), (0, 0)), constant_values=jnp.inf)
        return _solve(tuple(last), goal, method, valid)

    return _by_chunks(chunk, (edges, goal_ij), _is_large(edge_costs))


def field(
    classes: Int[Array | np.ndarray, "B H W"],
    levels: Int[Array | np.ndarray, "B H W"],
    costs: Costs | None = None,
    rules: Rules | None = None,
    goal_ij: Int[Array | np.ndarray, "B 2"] | None = None,
    method: str = "auto",
) -> CostToGo:
    """`cost_to_go` of `edge_costs`, without ever holding all edge costs: the fast path.

    Arguments as there. May be called inside jit. An arena's result does not depend on the others of its batch.
    """
    if goal_ij is None:
        raise InputError("must be given", field="goal_ij")
    batch = classes.shape[0]
    each = jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, (batch,)), (costs or Costs(), rules or Rules()))

    def chunk(classes, levels, each, goal):
        costs, rules = each
        last = (jnp.moveaxis(a, 0, -1) for a in (classes, levels))
        valid = jnp.stack([c >= 0 for c in jax.tree.leaves(costs)]).all(0)  # False for NaN as well
        costs = jax.tree.map(lambda c: jnp.where(valid, c, jnp.inf), costs)
        return _solve(half_edges(*last, costs, rules), goal, method, valid)

    inputs = jnp.asarray(classes), jnp.asarray(levels), each, jnp.asarray(goal_ij)
    return _by_chunks(chunk, inputs, _is_large(classes))


def _is_large(grids) -> bool:
    return grids.shape[-2] * grids.shape[-1] > LARGE


def _solve(edges, goal_ij, method, valid) -> CostToGo:
    if method not in ("auto", *kernels.METHODS):
        raise InputError(f"must be one of auto, {', '.join(kernels.METHODS)}", field="method", value=method)
    method = kernels.default_method() if method == "auto" else method
    # Sums along a path drift by up to half a unit in the last place a move: with float32 a path through a
    # large maze is off by more than 1e-5, so the kernels alone are then float64, in any program.
    large = _is_large(edges[0][1:-1, 1:-1, 0])
    with jax.enable_x64(large):
        dtype = jnp.float64 if large else jnp.float32
        if large and method == "line_sweep" and goal_ij.shape[0] == 1:
            cost, steps, converged = worklist.settle(edges, goal_ij, dtype)
        else:
            cost, steps, converged = kernels.settle(method, edges, goal_ij, dtype)
        cost, steps = jnp.moveaxis(cost[1:-1, 1:-1].astype(jnp.float32), -1, 0), steps.astype(jnp.int32)
    converged &= valid
    return CostToGo(jnp.where(converged[:, None, None], cost, jnp.inf), steps, converged)


def _by_chunks(solve, inputs, large):
    """`solve(*inputs)` in chunks of the leading axis, one after the other, each stopping by itself."""
    batch = inputs[0].shape[0]
    if batch < FEW:
        chunks, size = (batch, 1) if large else (1, batch)
    else:
        chunks = -(-batch // CHUNK)
        size = max(-(-batch // chunks), LANES)
    pad = chunks * size - batch
    parts = jax.tree.map(lambda a: jnp.pad(a, ((0, pad),) + ((0, 0),) * (a.ndim - 1), mode="edge"), inputs)
    if chunks == 1:
        out = solve(*parts)
    else:
        parts = jax.tree.map(lambda a: a.reshape(chunks, size, *a.shape[1:]), parts)
        out = lax.map(lambda part: solve(*part), parts)
        out = jax.tree.map(lambda a: a.reshape(chunks * size, *a.shape[2:]), out)
    return jax.tree.map(lambda a: a[:batch], out)
