"""One more view of each map of a batch, as a function of JAX arrays on a CPU."""

from __future__ import annotations

from functools import cache
from threading import Lock

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, UInt32

from jaxbiped.core import xla_ffi
from jaxbiped.core.ready_programs import TARGETS
from jaxbiped.mapping.grid import GridSpec
from jaxbiped.mapping.kernels.classes import class_arena
from jaxbiped.mapping.kernels.windows import INF, U, compiled
from jaxbiped.mapping.relief import FACE, Surfaces

NAME = "jaxbiped_map_update"
LOCK = Lock()
NUMBERS, LAYOUT = 10, 4  # how many numbers of each kind the kernel is given
POINT_KINDS = np.int32, np.bool_, np.float32, np.float32, np.float32
FACE_32, FEWEST = np.float32(FACE), np.float32(1e-6)


@compiled
def add_points(index, counts, pixels, share, z, shape, layout, heights, old, new, points):
    """`gridmap.voxelise` into `points`, and `relief.add_surfaces` from `old` (weight, rise) to `new`."""
    (height, width, depth, _, _), (lowest, _, _, grounds) = shape, layout
    (weights, rises), (new_weights, new_rises), cells = old, new, height * width
    points[:] = 0
    for n in range(len(weights)):
        new_weights[n], new_rises[n] = weights[n], rises[n]
    deep = np.uint32(depth)
    for n in range(len(index)):
        if not counts[n]:
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
def rows(buffers, k, batch, size, dtype):
    """Buffer number `k` as one row of so many elements for each arena."""
    return xla_ffi.array(buffers, k, batch * size, dtype).reshape((batch, size))


@compiled
def solve(arguments, count, results):
    """All arenas, as `xla_ffi.register` wants it; leading axes are batches."""
    rank, dims = xla_ffi.rank(arguments, 0), xla_ffi.shape(arguments, 0)
    batch = 1
    for axis in range(rank - 3):
        batch *= np.int64(dims[axis])
    height, width, depth = np.int64(dims[rank - 3]), np.int64(dims[rank - 2]), np.int64(dims[rank - 1])
    many = np.int64(xla_ffi.shape(arguments, 5)[rank - 3])
    reach = np.int64(xla_ffi.shape(arguments, 11)[rank - 3])
    given = xla_ffi.array(arguments, 13, LAYOUT, np.int32)
    lowest, aside, beside, grounds = np.int64(given[0]), np.int64(given[1]), np.int64(given[2]), np.int64(given[3])
    margin, cells = max(reach - 1, beside, 1), height * width
    shape, layout = (height, width, depth, margin, width + 2 * margin), (lowest, aside, beside, grounds)
    voxels, planes = cells * depth, cells * grounds
    evidence, more = rows(arguments, 0, batch, voxels, np.float32), rows(results, 0, batch, voxels, np.float32)
    votes, new_votes = rows(arguments, 1, batch, 4 * cells, np.float32), rows(results, 1, batch, 4 * cells, np.float32)
    level_votes, new_level_votes = (
        rows(arguments, 2, batch, planes, np.float32), rows(results, 2, batch, planes, np.float32)
    )  # fmt: skip
    weight, new_weight = rows(arguments, 3, batch, planes, np.float32), rows(results, 3, batch, planes, np.float32)
    rises, new_rises = rows(arguments, 4, batch, planes, np.float32), rows(results, 4, batch, planes, np.float32)
    index, counts = rows(arguments, 5, batch, many, np.int32), rows(arguments, 6, batch, many, np.bool_)
    pixels, share = rows(arguments, 7, batch, many, np.float32), rows(arguments, 8, batch, many, np.float32)
    z, numbers = rows(arguments, 9, batch, many, np.float32), rows(arguments, 10, batch, NUMBERS, np.float32)
    within, bands = rows(arguments, 11, batch, reach * reach, np.bool_), rows(arguments, 12, batch, 2, np.uint32)
    heights = xla_ffi.array(arguments, 14, grounds, np.float32)
    classes, levels = rows(results, 5, batch, cells, np.int8), rows(results, 6, batch, cells, np.int8)
    points, votes_of = np.empty(voxels, np.float32), np.empty(cells, np.float32)
    for b in range(batch):
        old, new = (weight[b], rises[b]), (new_weight[b], new_rises[b])
        add_points(index[b], counts[b], pixels[b], share[b], z[b], shape, layout, heights, old, new, points)
        add_evidence(points, shape, numbers[b], evidence[b], more[b], votes_of)
        disc = within[b].reshape((reach, reach))
        class_arena(more[b], new[0], new[1], shape, layout, numbers[b], heights, disc, bands[b], classes[b], levels[b])
        add_votes(votes_of, classes[b], levels[b], grounds, votes[b], level_votes[b], new_votes[b], new_level_votes[b])


@cache
def registered() -> str:
    """The name by which XLA knows the kernel; compiled at the first call."""
    TARGETS[NAME] = __name__, ()
    xla_ffi.register(NAME, solve, keep=True)
    return NAME


def add_view(
    grid_map: tuple[Float[Array, "H W Z"], Float[Array, "H W 4"], Float[Array, "H W G"], Surfaces],
    points: tuple[Int[Array, "N"], Bool[Array, "N"], Float[Array, "N"], Float[Array, "N"], Float[Array, "N"]],
    numbers: Float[Array, "K"],
    disc: Bool[Array, "R R"],
    bands: UInt32[Array, "2"],
    spec: GridSpec,
) -> tuple[Array, ...]:
    """(evidence, votes, level votes, weight, rise, classes int8 [H, W], ground levels int8 [H, W]) of one arena.

    Args:
      grid_map: the evidence, the votes, those of levels, and the surfaces before this view.
      points: of this view: the voxel of each, whether it counts, its pixels, how much they tell of the surface there,
        and its height above the base floor [m].
      numbers: least points of an occupied voxel; share of the points next to it; least points of a solid patch; the
        same below one, inf for none; standard error [m] of a height times the root of its pixels; step [m]; its
        tolerance; error [m] of the ground that a step bears; half of that; least points of a view's cell that votes.
      disc: which offsets of rows and columns lie within the body's radius (`cobstacles.disc`).
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
        (disc, (len(disc), len(disc)), np.bool_),
        (bands, (2,), np.uint32),
    )
    for array, shape, dtype in wanted:
        xla_ffi.expect(array, shape, dtype)
    layout = jnp.array([spec.lowest, spec.patch_aside, spec.beside, grounds], jnp.int32)
    cells = jax.ShapeDtypeStruct((height, width), jnp.int8)
    results = (*(jax.ShapeDtypeStruct(shape, jnp.float32) for _, shape in maps), cells, cells)
    call = jax.ffi.ffi_call(name, results, vmap_method="broadcast_all")
    return tuple(call(*(array for array, _, _ in wanted), layout, jnp.asarray(spec.ground_heights())))
