"""Fields of the time to go over (cell, heading): exact, on any device."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.core.batching import folding_vmap, unfold, without_gradient
from jaxbiped.core.checks import reals
from jaxbiped.errors import InputError
from jaxbiped.planning import kernels
from jaxbiped.planning.arguments import are_classes, grid_arguments
from jaxbiped.planning.cost_field import FEW, LARGE
from jaxbiped.planning.costs import BASE_PITCH, DIRECTIONS, Rules
from jaxbiped.planning.heading.times import Moves, Times, checked_pitch, heading_moves, moves_of

METHODS = ("wavefront", "line_sweep", "dijkstra")
NO_GRADIENT = "a field of times has no gradient: differentiate `planning.path_time` of the path that it gives"


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class HeadingField:
    """Shortest time from each cell and heading to the goal, in any heading there."""

    cost: Float[Array, "*B 8 H W"]  # [s]; inf: no path, or not converged
    moves: Moves  # the moves that it is based on
    turn: Float[Array, "*B"]  # [s] for 45 degrees
    converged: Bool[Array, "*B"]  # whether the times are exact: one more relaxation, which is done, lowers none


def heading_field(
    classes: Any,
    levels: Any,
    times: Times | None = None,
    rules: Rules | None = None,
    goal_ij: Any = None,
    pitch: float = BASE_PITCH,
    extra: Any = None,
    method: str = "auto",
) -> HeadingField:
    """Shortest time from each (heading, cell) to `goal_ij`, with the moves of `heading_moves` and turns on the spot.

    The state of the robot's plan is its cell and which of the eight directions it faces. Turning by 45 degrees takes
    `times.turn`, anywhere; a move is made facing its direction. So the result is the time of the best plan including
    turns, while Eq. 1 has no turns (an extension of the paper). Leading axes broadcast. May be called inside `jit`,
    `vmap` and `scan`. There is no gradient: differentiate `path_time` of the path that the field gives.

    Args:
      classes, levels, times, rules, pitch, extra: see `heading_moves`; Table 2's times by default. A map with a time
        that is NaN, negative or infinite does not converge.
      goal_ij: [*B, 2], integers, row and column; a goal outside the grid cannot be reached.
      method: static: "wavefront" (any device), "line_sweep" or "dijkstra" (CPU), or "auto": line sweeps on a CPU, but
        Dijkstra for few large grids, and the wavefront on other devices.

    Raises:
      InputError: an argument of another rank, shape or dtype, or a value out of range where values are concrete; a
        method that this device does not have.
    """
    if goal_ij is None:
        raise InputError("must be given", field="goal_ij")
    on_cpu = jax.default_backend() == "cpu"
    allowed = METHODS if on_cpu else METHODS[:1]
    if method not in ("auto", *allowed):
        raise InputError(f"must be one of auto, {', '.join(allowed)} on this device", field="method", value=method)
    pitch = checked_pitch(pitch)
    arrays = {} if extra is None else {"extra": (reals("extra", extra, "8 H W"), "8 H W")}
    given = grid_arguments(classes, levels, times or Times(), rules or Rules(), arrays=arrays, goal_ij=goal_ij)
    batch, (classes, levels, times, rules, *more, goal_ij) = given
    size = classes.shape[1] * classes.shape[2]
    if method == "auto":
        method = ("dijkstra" if size > LARGE and len(classes) < FEW else "line_sweep") if on_cpu else "wavefront"
    if size == 0 or len(classes) == 0:
        moves = heading_moves(classes, levels, times, rules, pitch, more[0] if more else None)
        field = HeadingField(jnp.zeros(moves.time.shape), moves, times.turn, jnp.ones(len(classes), bool))
        return unfold(field, batch)
    inputs = jax.tree.map(jnp.asarray, (classes, levels, times, rules, goal_ij, *more))
    return unfold(settled(inputs, pitch, method), batch)


@cache
def differentiated(pitch: float, method: str):
    """The field as a function of arrays that supports `vmap` and `grad`."""
    return without_gradient(folding_vmap(partial(solve, pitch=pitch, method=method)), NO_GRADIENT)


@partial(jax.jit, static_argnames=("pitch", "method"))
def settled(inputs, pitch: float, method: str) -> HeadingField:
    """`heading_field` of arrays [B]: classes, levels, times, rules, goal_ij, and extra if there is any."""
    return differentiated(pitch, method)(*inputs)


def solve(classes, levels, times: Times, rules: Rules, goal_ij, extra=None, *, pitch: float, method: str):
    """`settled`, without the rules for `vmap` and `grad`."""
    valid = jnp.stack([(leaf >= 0) & (leaf < jnp.inf) for leaf in jax.tree.leaves(times)]).all(0)  # excludes NaN
    times = jax.tree.map(lambda leaf: jnp.where(valid, leaf, 0.0), times)
    moves = moves_of(classes, levels, times, rules, pitch, extra)
    valid &= are_classes(classes) & (moves.time >= 0).all((1, 2, 3))
    goal_ij = jnp.where(valid[:, None], goal_ij, -1)  # from where nothing can be reached
    with jax.enable_x64(True):  # sums of a thousand moves drift as float32
        if method == "wavefront":
            cost, proven = wavefront(moves.time, moves.face, times.turn, goal_ij)
        else:
            cost, proven = kernels.solve_headings(moves.time, moves.face, times.turn, goal_ij, method)
        return HeadingField(cost, moves, times.turn, valid & proven)


def wavefront(
    time: Float[Array, "B 8 H W"], face: Int[Array, "B 8 H W"], turn: Float[Array, "B"], goal_ij: Int[Array, "B 2"]
) -> tuple[Float[Array, "B 8 H W"], Bool[Array, "B"]]:
    """Relax all states at once until nothing changes: little depth and much work, as suits an accelerator.

    Each round makes one move and any turn. Sums are float64. Also returns whether the last round changed nothing.
    """
    batch, _, height, width = time.shape
    rows, columns = jnp.arange(height)[:, None], jnp.arange(width)
    goal = (rows == goal_ij[:, 0, None, None]) & (columns == goal_ij[:, 1, None, None])
    start = jnp.broadcast_to(jnp.where(goal, 0.0, jnp.inf).astype(jnp.float64)[:, None], time.shape)
    turn, time = turn[:, None, None, None].astype(jnp.float64), time.astype(jnp.float64)
    # in each heading three moves are possible, its own and those at 45 degrees to it; the state each leads to
    heading, off = np.arange(8)[:, None], np.array([-1, 0, 1])
    k = (heading + off) % 8
    taken = jnp.where(face[:, k] == heading[..., None, None], time[:, k], jnp.inf)  # [B, 8, 3, H, W]
    i, j = (np.arange(n) + DIRECTIONS[k][:, :, axis, None] for axis, n in ((0, height), (1, width)))
    inside = ((i >= 0) & (i < height))[..., None] & ((j >= 0) & (j < width))[:, :, None]
    to = (heading[..., None, None] * height + i[..., None]) * width + j[:, :, None]
    to = np.where(inside, to, 0)  # any cell: such a move is forbidden

    def body(state):
        cost, _, step = state
        after = cost.reshape(batch, 8 * height * width)[:, to]
        new = jnp.minimum(cost, (after + taken).min(2))
        for eighths in (1, 2, 1):  # together they reach all turns up to 180 degrees
            for way in (eighths, -eighths):
                new = jnp.minimum(new, jnp.roll(new, way, axis=1) + eighths * turn)
        return new, jnp.any(new < cost, axis=(1, 2, 3)), step + 1

    # A round settles at least one more state of each shortest path.
    again = lambda state: jnp.any(state[1]) & (state[2] < most_rounds(height, width))  # noqa: E731
    cost, changed, _ = lax.while_loop(again, body, (start, jnp.ones(batch, bool), jnp.int32(0)))
    return cost.astype(jnp.float32), ~changed


def most_rounds(height: int, width: int) -> int:
    """Number of rounds after which nothing can change any more: the last of them shows it."""
    return 8 * height * width + 1
