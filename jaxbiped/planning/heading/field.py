"""Fields of the time to go over (cell, heading): exact, on any device."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.errors import InputError
from jaxbiped.planning import compiled
from jaxbiped.planning.costs import BASE_PITCH, DIRECTIONS, Rules
from jaxbiped.planning.field import FEW, LARGE
from jaxbiped.planning.heading.times import Moves, Times, heading_moves

METHODS = ("wavefront", "line_sweep", "dijkstra")


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class HeadingField:
    """Least time from each cell and heading to the goal, in any heading there."""

    cost: Float[Array, "B 8 H W"]  # [s]; inf: no way, or not converged
    moves: Moves  # that it is made of
    turn: Float[Array, "B"]  # [s] for 45 degrees
    converged: Bool[Array, "B"]  # False: times that are NaN, negative or infinite


def heading_field(
    classes: Int[Array | np.ndarray, "B H W"],
    levels: Int[Array | np.ndarray, "B H W"],
    times: Times | None = None,
    rules: Rules | None = None,
    goal_ij: Int[Array | np.ndarray, "B 2"] | None = None,
    pitch: float = BASE_PITCH,
    extra: Float[Array, "B 8 H W"] | None = None,
    method: str = "auto",
) -> HeadingField:
    """Least time from each (heading, cell) to `goal_ij`, on the moves of `heading_moves` and turns on the spot.

    The state of the robot's plan is its cell and which of the eight directions it faces. Turning by 45 degrees takes
    `times.turn`, anywhere; a move is made facing its direction. So the least time is that of the best plan, turns and
    all, where Eq. 1 knows no turns (an extension of the paper). May be called inside jit.

    Args:
      classes, levels, times, rules, pitch, extra: see `heading_moves`; Table 2's times by default.
      goal_ij: row and column; a goal outside the grid is reached from nowhere.
      method: static: "wavefront" (any device), "line_sweep" or "dijkstra" (CPU), or "auto": line sweeps on a CPU,
        Dijkstra there for few large grids, the wavefront elsewhere.

    Raises:
      InputError: no goal, or a method that this device does not have.
    """
    if goal_ij is None:
        raise InputError("must be given", field="goal_ij")
    on_cpu = jax.default_backend() == "cpu"
    allowed = METHODS if on_cpu else METHODS[:1]
    if method not in ("auto", *allowed):
        raise InputError(f"must be one of auto, {', '.join(allowed)} on this device", field="method", value=method)
    large = classes.shape[1] * classes.shape[2] > LARGE
    if method == "auto":
        method = ("dijkstra" if large and len(classes) < FEW else "line_sweep") if on_cpu else "wavefront"
    batch = classes.shape[:1]
    times, rules = (  # of one type, whatever they were given as: one program
        jax.tree.map(lambda leaf, kind=kind: jnp.broadcast_to(jnp.asarray(leaf, kind), batch), tree)
        for tree, kind in ((times or Times(), jnp.float32), (rules or Rules(), bool))
    )
    return settled(
        jnp.asarray(classes), jnp.asarray(levels), times, rules, jnp.asarray(goal_ij, jnp.int32), extra, pitch, method
    )


@partial(jax.jit, static_argnames=("pitch", "method"))
def settled(classes, levels, times: Times, rules: Rules, goal_ij, extra, pitch: float, method: str) -> HeadingField:
    """`heading_field` of arguments that are all arrays [B]."""
    valid = jnp.stack([(leaf >= 0) & (leaf < jnp.inf) for leaf in jax.tree.leaves(times)]).all(0)  # no NaN either
    times = jax.tree.map(lambda leaf: jnp.where(valid, leaf, 0.0), times)
    moves = heading_moves(classes, levels, times, rules, pitch, extra)
    goal_ij = jnp.where(valid[:, None], goal_ij, -1)  # from where nothing is reached
    inputs = moves.time, moves.face, times.turn, goal_ij
    if method == "wavefront":
        cost = wavefront(*inputs)
    else:
        large = classes.shape[1] * classes.shape[2] > LARGE  # long sums drift as float32
        cost = compiled.settle_headings(*inputs, method, large)
    return HeadingField(cost, moves, times.turn, valid)


def wavefront(
    time: Float[Array, "B 8 H W"], face: Int[Array, "B 8 H W"], turn: Float[Array, "B"], goal_ij: Int[Array, "B 2"]
) -> Float[Array, "B 8 H W"]:
    """All states relaxed at once until nothing changes: little depth and much work, as an accelerator wants.

    Each round makes one move and any turn.
    """
    batch, _, height, width = time.shape
    rows, columns = jnp.arange(height)[:, None], jnp.arange(width)
    goal = (rows == goal_ij[:, 0, None, None]) & (columns == goal_ij[:, 1, None, None])
    start = jnp.broadcast_to(jnp.where(goal, 0.0, jnp.inf)[:, None], time.shape)
    turn = turn[:, None, None, None]
    # in each heading three moves may be made, its own and those 45 degrees to either side; the state each leads to
    heading, off = np.arange(8)[:, None], np.array([-1, 0, 1])
    k = (heading + off) % 8
    taken = jnp.where(face[:, k] == heading[..., None, None], time[:, k], jnp.inf)  # [B, 8, 3, H, W]
    i, j = (np.arange(n) + DIRECTIONS[k][:, :, axis, None] for axis, n in ((0, height), (1, width)))
    inside = ((i >= 0) & (i < height))[..., None] & ((j >= 0) & (j < width))[:, :, None]
    to = (heading[..., None, None] * height + i[..., None]) * width + j[:, :, None]
    to = np.where(inside, to, 0)  # nowhere: such a move is forbidden

    def body(state):
        cost, _, step = state
        after = cost.reshape(batch, 8 * height * width)[:, to]
        new = jnp.minimum(cost, (after + taken).min(2))
        for eighths in (1, 2, 1):  # which together reach all that is up to 180 degrees off
            for way in (eighths, -eighths):
                new = jnp.minimum(new, jnp.roll(new, way, axis=1) + eighths * turn)
        return new, jnp.any(new < cost), step + 1

    # A round settles one more state of each least way at least.
    again = lambda state: state[1] & (state[2] < 8 * height * width)  # noqa: E731
    return lax.while_loop(again, body, (start, jnp.bool_(True), jnp.int32(0)))[0]
