"""One more view of each map of a batch, as a function of JAX arrays on a CPU."""

from __future__ import annotations

from functools import cache
from threading import Lock

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, UInt32
from numba import carray

from jaxbiped.core import xla_ffi
from jaxbiped.core.ready_programs import TARGETS
from jaxbiped.mapping.grid import GridSpec
from jaxbiped.mapping.kernels.classes import class_arena
from jaxbiped.mapping.kernels.windows import INF, U, compiled
from jaxbiped.mapping.relief import FACE, Surfaces

NAME = "jaxbiped_map_update"
LOCK = Lock()
NUMBERS, LAYOUT = 10, 4  # how many numbers of each kind the kernel is given
POINT_KINDS = np.int32, np.float32, np.float32, np.float32
FACE_32, FEWEST = np.float32(FACE), np.float32(1e-6)


@compiled
def add_points(index, pixels, share, z, shape, layout, heights, weights, rises, new_weights, new_rises, points):
    """`gridmap.voxelise` into `points`, and `relief.add_surfaces` to the weights and rises of the surfaces."""
    cells, depth, lowest, grounds = shape[0] * shape[1], shape[2], layout[0], layout[3]
    for n in range(U(len(points))):
        points[n] = np.float32(0)
    for n in range(U(len(weights))):
        new_weights[n], new_rises[n] = weights[n], rises[n]
    deep = np.uint32(depth)
    for n in range(len(index)):
        if index[n] < 0:
            continue
        voxel = np.uint32(index[n])
        points[U(voxel)] += pixels[n]
        cell = voxel // deep
        level = max(np.int64(voxel - cell * deep) + lowest, 0)
        if level >= grounds:
            continue
        at = level * cells + np.int64(cell)
        rise, least = z[n] - heights[level], -INF
        if level > 0 and weights[at] > 0:
            least = rises[at] / max(weights[at], FEWEST) - FACE_32
        if rise >= least:
            new_weights[at] += share[n]
            new_rises[at] += share[n] * rise


@compiled
def add_evidence(points, shape, numbers, evidence, more, count):
    """Too few points in a voxel are none, and too few in a cell do not vote: `gridmap.update`."""
    (height, width, depth, _, _), least, least_votes = shape, numbers[0], numbers[9]
    for n in range(len(points)):
        here = points[n] if points[n] >= least else np.float32(0)
        points[n] = here
        more[n] = evidence[n] + here
    for cell in range(height * width):
        total, at = np.float32(0), U(cell * depth)
        for z in range(U(depth)):
            total += points[at + z]
        count[cell] = total if total >= least_votes else np.float32(0)


@compiled
def add_votes(count, classes, levels, grounds, votes, level_votes, new_votes, new_level_votes):
    """`gridmap.add_votes`."""
    for n in range(len(votes)):
        new_votes[n] = votes[n]
    for n in range(len(level_votes)):
        new_level_votes[n] = level_votes[n]
    for cell in range(len(count)):
        new_votes[4 * cell + classes[cell] - 1] += count[cell]
        new_level_votes[grounds * cell + levels[cell]] += count[cell]


@compiled
def floats(buffers, k, arena, size):
    """The `size` numbers of one arena in buffer number `k`."""
    return carray(xla_ffi.pointer(xla_ffi.data(buffers, k) + U(4) * U(arena * size)), (size,), np.float32)


@compiled
def integers(buffers, k, arena, size):
    """The same of int32."""
    return carray(xla_ffi.pointer(xla_ffi.data(buffers, k) + U(4) * U(arena * size)), (size,), np.int32)


@compiled
def bytes_of(buffers, k, arena, size):
    """The same of int8."""
    return carray(xla_ffi.pointer(xla_ffi.data(buffers, k) + U(arena * size)), (size,), np.int8)


@compiled
def solve(arguments, count, results):
    """All arenas, as `xla_ffi.register` wants it; leading axes are batches."""
    rank, dims = xla_ffi.rank(arguments, U(0)), xla_ffi.shape(arguments, U(0))
    batch = 1
    for axis in range(rank - 3):
        batch *= np.int64(dims[axis])
    height, width, depth = np.int64(dims[rank - 3]), np.int64(dims[rank - 2]), np.int64(dims[rank - 1])
    if batch == 0:
        return
    many = np.int64(xla_ffi.shape(arguments, U(5))[rank - 3])
    reach = np.int64(xla_ffi.shape(arguments, U(10))[rank - 3])
    given = integers(arguments, U(12), 0, LAYOUT)
    lowest, aside, beside, grounds = np.int64(given[0]), np.int64(given[1]), np.int64(given[2]), np.int64(given[3])
    margin, cells = max(reach - 1, beside, 1), height * width
    shape, layout = (height, width, depth, margin, width + 2 * margin), (lowest, aside, beside, grounds)
    voxels, planes = cells * depth, cells * grounds
    heights = floats(arguments, U(13), 0, grounds)
    points, votes = np.empty(voxels, np.float32), np.empty(cells, np.float32)
    for b in range(batch):
        numbers, more = floats(arguments, U(9), b, NUMBERS), floats(results, U(0), b, voxels)
        new_weight, new_rise = floats(results, U(3), b, planes), floats(results, U(4), b, planes)
        classes, levels = bytes_of(results, U(5), b, cells), bytes_of(results, U(6), b, cells)
        add_points(
            integers(arguments, U(5), b, many), floats(arguments, U(6), b, many), floats(arguments, U(7), b, many),
            floats(arguments, U(8), b, many), shape, layout, heights, floats(arguments, U(3), b, planes),
            floats(arguments, U(4), b, planes), new_weight, new_rise, points,
        )  # fmt: skip
        add_evidence(points, shape, numbers, floats(arguments, U(0), b, voxels), more, votes)
        class_arena(
            more, new_weight, new_rise, shape, layout, numbers, heights, integers(arguments, U(10), b, reach),
            integers(arguments, U(11), b, 2), classes, levels,
        )  # fmt: skip
        add_votes(
            votes, classes, levels, grounds, floats(arguments, U(1), b, 4 * cells), floats(arguments, U(2), b, planes),
            floats(results, U(1), b, 4 * cells), floats(results, U(2), b, planes),
        )  # fmt: skip


@cache
def registered() -> str:
    """The name by which XLA knows the kernel; compiled at the first call."""
    TARGETS[NAME] = __name__, ()
    xla_ffi.register(NAME, solve, keep=True)
    return NAME


def add_view(
    grid_map: tuple[Float[Array, "H W Z"], Float[Array, "H W 4"], Float[Array, "H W G"], Surfaces],
    points: tuple[Int[Array, "N"], Float[Array, "N"], Float[Array, "N"], Float[Array, "N"]],
    numbers: Float[Array, "K"],
    reaches: Int[Array, "R"],
    bands: UInt32[Array, "2"],
    spec: GridSpec,
) -> tuple[Array, ...]:
    """(evidence, votes, level votes, weight, rise, classes int8 [H, W], ground levels int8 [H, W]) of one arena.

    Args:
      grid_map: the evidence, the votes, those of levels, and the surfaces before this view.
      points: of this view: the voxel of each, -1 if it does not count, its pixels, how much they tell of the surface
        there, and its height above the base floor [m].
      numbers: least points of an occupied voxel; share of the points next to it; least points of a solid patch; the
        same below one, inf for none; square of the standard error [m] of a height, times its pixels; step [m]; its
        tolerance; error [m] of the ground that a step bears; half of that; least points of a view's cell that votes.
      reaches: how far the disc of the body's radius goes along a row so many rows away; -1: nowhere.
      bands: levels, counted from the ground, that squatting and standing bodies meet.
    """
    with LOCK:
        name = registered()
    (height, width), grounds = spec.shape, spec.ground_levels
    evidence, votes, level_votes, surfaces = grid_map
    maps = (
        (evidence, (height, width, spec.levels)),
        (votes, (height, width, 4)),
        (level_votes, (height, width, grounds)),
        (surfaces.weight, (grounds, height, width)),
        (surfaces.rise, (grounds, height, width)),
    )
    wanted = (
        *((array, shape, np.float32) for array, shape in maps),
        *((array, points[0].shape, kind) for array, kind in zip(points, POINT_KINDS, strict=True)),
        (numbers, (NUMBERS,), np.float32),
        (reaches, reaches.shape, np.int32),
        (jax.lax.bitcast_convert_type(bands, jnp.int32), (2,), np.int32),
    )
    for array, shape, dtype in wanted:
        xla_ffi.expect(array, shape, dtype)
    layout = jnp.array([spec.lowest, spec.patch_aside, spec.beside, grounds], jnp.int32)
    cells = jax.ShapeDtypeStruct((height, width), jnp.int8)
    results = (*(jax.ShapeDtypeStruct(shape, jnp.float32) for _, shape in maps), cells, cells)
    call = jax.ffi.ffi_call(name, results, vmap_method="broadcast_all")
    return tuple(call(*(array for array, _, _ in wanted), layout, jnp.asarray(spec.ground_heights())))
