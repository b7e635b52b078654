"""Cost-to-go fields rooted at the goal: `cost_to_go` on given edge costs, `field` straight from a class grid."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.errors import InputError
from jaxbiped.planning import kernels
from jaxbiped.planning.costs import Costs, Rules, edges_batch_last

CHUNK = 64  # arenas relaxed together: what fits the cache, and few enough that one slow map holds few others
SINGLE_CELLS = 1100  # grids up to this size are summed in float32, larger ones in float64 (see `settled`)


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
    return _by_chunks(lambda e, g: _solve(jnp.moveaxis(e, 0, -1), g, method), (edges, goal_ij))


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
        return _solve(edges_batch_last(*last, costs, rules), goal, method, valid)

    return _by_chunks(chunk, (jnp.asarray(classes), jnp.asarray(levels), each, jnp.asarray(goal_ij)))


def _solve(edges, goal_ij, method, valid=None) -> CostToGo:
    if method not in ("auto", *kernels.METHODS):
        raise InputError(f"must be one of auto, {', '.join(kernels.METHODS)}", field="method", value=method)
    relax = kernels.METHODS[kernels.default_method() if method == "auto" else method]
    if valid is None:
        valid = (edges >= 0).all((0, 1, 2))
    edges = jnp.where(valid, edges, jnp.inf)
    # Sums along a path drift by up to half a unit in the last place a move: with float32 a path through a
    # large maze is off by more than 1e-5, so the kernels alone are then float64, in any program.
    with jax.enable_x64(edges.shape[1] * edges.shape[2] > SINGLE_CELLS):
        if edges.shape[1] * edges.shape[2] > SINGLE_CELLS:
            edges = edges.astype(jnp.float64)
        cost, rounds, converged = kernels.settle(relax, edges, goal_ij)
        cost = jnp.moveaxis(cost.astype(jnp.float32), -1, 0)
    converged &= valid
    cost = jnp.where(converged[:, None, None], cost, jnp.inf)
    return CostToGo(cost, rounds, converged)


def _by_chunks(solve, inputs):
    """`solve(*inputs)` in chunks of the leading axis, one after the other, each stopping by itself."""
    batch = inputs[0].shape[0]
    if batch <= CHUNK:
        return solve(*inputs)
    chunks = -(-batch // CHUNK)
    fill = chunks * CHUNK - batch
    pad = lambda a: jnp.pad(a, ((0, fill),) + ((0, 0),) * (a.ndim - 1), mode="edge")  # noqa: E731
    parts = jax.tree.map(lambda a: pad(a).reshape(chunks, CHUNK, *a.shape[1:]), inputs)
    out = lax.map(lambda part: solve(*part), parts)
    return jax.tree.map(lambda a: a.reshape(chunks * CHUNK, *a.shape[2:])[:batch], out)
