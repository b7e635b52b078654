"""The direction in which each move over an edge of the ground is played: perpendicular to it, to 45 degrees."""

from __future__ import annotations

import math
from functools import cache, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int, Int8

from jaxbiped.core.batching import folding_vmap, unfold
from jaxbiped.mapping.grid import Cell
from jaxbiped.planning import kernels
from jaxbiped.planning.arguments import grid_arguments
from jaxbiped.planning.costs import DIRECTIONS

WINDOW = 0.20  # [m] radius of the disc of cells around a move that determine its edge; as in `motion.edge`
SLANT = math.radians(50.0)  # the edge is assumed to deviate no more than this from perpendicular; as in `motion.edge`
EIGHTH = math.pi / 4
NOWHERE = 999  # not a level


def crossing_faces(classes: Any, levels: Any, pitch: float) -> Int8[Array, "*B 8 H W"]:
    """The direction (of the eight) nearest to perpendicular to the edge, for each move out of each cell.

    `motion.edge.crossing_direction` for all moves at once (paper, 2.4), rounded to 45 degrees. It is meaningful only
    for moves over an edge of one level; if no edge is seen it is the move's own direction. Leading axes broadcast.

    Args:
      classes, levels: as for `planning.field`.
      pitch: static [m].

    Raises:
      InputError: an argument of another rank, shape or dtype, or a value out of range where values are concrete.
    """
    batch, (classes, levels) = grid_arguments(classes, levels)
    known = (classes != Cell.UNMEASURED) & (classes < Cell.OBSTACLE) & (classes >= 0)
    if known.size == 0:
        return unfold(jnp.zeros((len(known), 8, *known.shape[1:]), jnp.int8), batch)
    faces = on_cpu(window(pitch)) if jax.default_backend() == "cpu" else partial(dense_faces, pitch=pitch)
    return unfold(faces(jnp.asarray(known), jnp.asarray(levels)), batch)


@cache
def on_cpu(half: int):
    """The compiled kernel for a window of `half` cells, as a function that supports `vmap`."""
    return folding_vmap(lambda known, levels: kernels.crossing_faces(known, levels, half, SLANT))


def window(pitch: float) -> int:
    """`WINDOW` in cells."""
    return max(1, round(WINDOW / pitch))


def dense_faces(known: Bool[Array, "B H W"], levels: Int[Array, "B H W"], pitch: float) -> Int8[Array, "B 8 H W"]:
    """The same for accelerators: all moves, by convolutions.

    A move and its reverse are perpendicular to the same edge, so only half of them are computed.
    """
    here = levels.astype(jnp.int32)
    there = jnp.stack([beside(here, *DIRECTIONS[k], NOWHERE) for k in range(4)], axis=1)
    kernel = jnp.asarray(discs(pitch))
    shape = (len(known), 4, 3, *known.shape[1:])

    def one_level(level, sums):
        # both sums are over cells of one level, level by level: there are few
        ground = (known & (here == level)).astype(jnp.float32)[:, None]
        sums_here = lax.conv_general_dilated(ground, kernel, (1, 1), "SAME", precision="highest").reshape(shape)
        beyond = jnp.where((there == level)[:, :, None], sums_here, sums[0])
        return beyond, jnp.where((here == level)[:, None, None], sums_here, sums[1])

    low, high = (f(jnp.where(known, here, o)) for f, o in ((jnp.min, NOWHERE), (jnp.max, -NOWHERE)))
    beyond, before = lax.fori_loop(low, high + 1, one_level, (jnp.zeros(shape), jnp.zeros(shape)))
    first = jnp.stack([square(k, (beyond - before)[:, k], (beyond + before)[:, k]) for k in range(4)], axis=1)
    # the reverse move starts at the other end
    back = [(beside(first[:, k], *DIRECTIONS[k + 4], 0) + 4) % 8 for k in range(4)]
    return jnp.concatenate([first, jnp.stack(back, axis=1)], axis=1).astype(jnp.int8)


def discs(pitch: float) -> Float[np.ndarray, "12 1 n n"]:
    """For the first four directions, over a disc of cells around the middle of the move: one, and the offset (i, j)."""
    half = window(pitch)
    i, j = np.mgrid[-half : half + 1, -half : half + 1]
    kernels = []
    for di, dj in DIRECTIONS[:4]:
        moments = np.stack([np.ones_like(i), i - di / 2, j - dj / 2])
        kernels.append(moments * (np.hypot(i - di / 2, j - dj / 2) <= half))
    return np.concatenate(kernels)[:, None].astype(np.float32)


def square(k: int, total: Float[Array, "B 3 H W"], count: Float[Array, "B 3 H W"]) -> Int[Array, "B H W"]:
    """The direction nearest to perpendicular to the edge under moves in direction k.

    Args:
      total, count: of the cells beyond the edge minus, and plus, those before it: how many, and first moments.
    """
    share = total[:, 0] / jnp.maximum(count[:, 0], 1.0)
    di, dj = (total[:, axis] - count[:, axis] * share for axis in (1, 2))
    angle = jnp.arctan2(di, dj)
    off = jnp.mod(angle - k * EIGHTH + math.pi, 2 * math.pi) - math.pi
    believed = (jnp.abs(total[:, 0]) < count[:, 0]) & (jnp.abs(off) < SLANT)
    return jnp.where(believed, k + jnp.round(off / EIGHTH).astype(jnp.int32), k) % 8


def beside(array: Array, di: int | np.integer, dj: int | np.integer, outside: float | int) -> Array:
    """`array[b, i + di, j + dj]`, or `outside` beyond the grid."""
    height, width = array.shape[-2:]
    padded = jnp.pad(array, [(0, 0)] * (array.ndim - 2) + [(1, 1), (1, 1)], constant_values=outside)
    return padded[..., 1 + di : 1 + di + height, 1 + dj : 1 + dj + width]
