"""The direction square to each edge of the ground, compiled for a CPU: only moves over an edge take any time."""

from __future__ import annotations

import math
from functools import cache
from threading import Lock

import jax
import jax.numpy as jnp
import numpy as np
from numba import njit

from jaxbiped.core import xla_ffi
from jaxbiped.core.ready_programs import TARGETS
from jaxbiped.planning.costs import DIRECTIONS

DI, DJ = (tuple(int(d) for d in column) for column in DIRECTIONS.T)
NAME = "jaxbiped_crossing_faces"
EIGHTH = math.pi / 4
LOCK = Lock()


@njit(nogil=True)
def square(known, level, i, j, k, half, slant):
    """The direction nearest to square to the edge under the move from cell (i, j) in direction k."""
    height, width = level.shape
    here, there = level[i, j], level[i + DI[k], j + DJ[k]]
    total, total_i, total_j, count, count_i, count_j = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for a in range(max(i - half, 0), min(i + half + 1, height)):
        for b in range(max(j - half, 0), min(j + half + 1, width)):
            y, x = a - i - DI[k] / 2, b - j - DJ[k] / 2
            if known[a, b] and y * y + x * x <= half * half and (level[a, b] == here or level[a, b] == there):
                sign = 1.0 if level[a, b] == there else -1.0
                total, total_i, total_j = total + sign, total_i + sign * y, total_j + sign * x
                count, count_i, count_j = count + 1, count_i + y, count_j + x
    if abs(total) >= count:  # one side alone is seen
        return k
    share = total / count
    off = math.atan2(total_i - count_i * share, total_j - count_j * share) - k * EIGHTH
    off = (off + math.pi) % (2 * math.pi) - math.pi
    return (k + round(off / EIGHTH)) % 8 if abs(off) < slant else k


@njit(nogil=True)
def solve(arguments, count, results):
    """All arenas, as `xla_ffi.register` wants it."""
    dims = xla_ffi.shape(arguments, 0)
    batch, height, width = np.int64(dims[0]), np.int64(dims[1]), np.int64(dims[2])
    cells = height * width
    kinds = xla_ffi.array(arguments, 0, batch * cells, np.bool_)
    grounds = xla_ffi.array(arguments, 1, batch * cells, np.int16)
    half, slant = xla_ffi.array(arguments, 2, 2, np.float32)
    faces = xla_ffi.array(results, 0, batch * 8 * cells, np.int8)
    for arena in range(batch):
        known = kinds[arena * cells : (arena + 1) * cells].reshape((height, width))
        level = grounds[arena * cells : (arena + 1) * cells].reshape((height, width))
        face = faces[arena * 8 * cells : (arena + 1) * 8 * cells].reshape((8, height, width))
        for k in range(8):
            face[k] = k
        for k in range(4):
            for i in range(height - DI[k]):
                for j in range(max(-DJ[k], 0), width - max(DJ[k], 0)):
                    a, b = i + DI[k], j + DJ[k]
                    if known[i, j] and known[a, b] and abs(level[i, j] - level[a, b]) == 1:
                        found = square(known, level, i, j, k, int(half), slant)
                        face[k, i, j], face[k + 4, a, b] = found, (found + 4) % 8


@cache
def registered() -> str:
    """The name by which XLA knows the kernel; compiled at the first call."""
    TARGETS[NAME] = __name__, ()
    xla_ffi.register(NAME, solve, keep=True)
    return NAME


def crossing_faces(known, levels, half: int, slant: float):
    """As `heading.crossing.crossing_faces`, int8 [B, 8, H, W]; the move's own direction where it is over no edge.

    Args:
      known: bool [B, H, W], cells that count. levels: integers [B, H, W].
      half: cells; slant: [rad].
    """
    with LOCK:
        name = registered()
    batch, height, width = known.shape
    levels = levels.astype(jnp.int16)
    xla_ffi.expect(known, (batch, height, width), np.bool_)
    xla_ffi.expect(levels, (batch, height, width), np.int16)
    result = jax.ShapeDtypeStruct((batch, 8, height, width), jnp.int8)
    return jax.ffi.ffi_call(name, result)(known, levels, jnp.array([half, slant], jnp.float32))
