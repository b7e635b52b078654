"""Columns of voxels as masks of their levels (`mapping.cobstacles`)."""

import numpy as np

from jaxbiped.mapping.kernels.windows import INF, U, compiled, greater_of, masks_of


@compiled
def pack(points, at, least, bits):
    """The mask of the voxels of one column that hold at least so many points."""
    mask, at = np.uint32(0), U(at)
    for z in range(U(len(bits))):
        mask |= bits[z] if points[at + z] >= least else np.uint32(0)
    return mask


@compiled
def greatest(points, at, size):
    """The greatest of so many numbers, none below 0, from `at` on: as integers of the same bits, of the same order."""
    most, at = np.int32(0), U(at)
    for z in range(U(size)):
        most = max(most, points[at + z])
    return most


@compiled
def pack_occupied(points, at, beside, least, share, bits):
    """The mask of the occupied voxels of one column; `beside`: the more points of the voxels above and below each."""
    mask, at = np.uint32(0), U(at)
    for z in range(U(len(bits))):
        here = points[at + z]
        mask |= bits[z] if (here > 0) & (here >= least) & (here >= share * beside[at + z]) else np.uint32(0)
    return mask


@compiled
def find_ground(mask, points, at, lowest, grounds):
    """`cobstacles.ground_level` of the column with this mask of occupied levels."""
    run = mask & ~(mask + (mask & (~mask + np.uint32(1))))
    best, most = 0, np.float32(0)
    if run >> np.uint32(grounds):
        return best
    for level in range(grounds):
        here = points[at + level - lowest]
        if (run >> np.uint32(level)) & np.uint32(1) and here > most:
            best, most = level, here
    return best


@compiled
def most_beside(points, z, i, j, height, width, depth, beside):
    """The most points in the columns within `beside` of cell (i, j), one level above or below voxel z."""
    most = np.float32(0)
    for a in range(max(i - beside, 0), min(i + beside + 1, height)):
        for b in range(max(j - beside, 0), min(j + beside + 1, width)):
            at = (a * width + b) * depth + z
            if z > 0:
                most = max(most, points[at - 1])
            if z + 1 < depth:
                most = max(most, points[at + 1])
    return most


@compiled
def read_columns(evidence, shape, layout, numbers, bits, points, columns, ground, peaks):
    """`cobstacles.occupied_levels` and `ground_level`; and the most points of a patch in each column."""
    (height, width, depth, margin, across), (lowest, _, _, grounds) = shape, layout
    beside, size = np.empty(len(evidence), np.float32), len(evidence)
    greater_of(evidence, 0, evidence, 2, size - 2, beside, 1)
    for first in range(0, size, depth):  # the ends of columns are not each other's neighbours
        beside[first], beside[first + depth - 1] = evidence[first + 1], evidence[first + depth - 2]
    whole, peaks = points.view(np.int32), peaks.view(np.int32)
    for i in range(height):
        for j in range(width):
            first, at = (i * width + j) * depth, (i + margin) * across + j + margin
            columns[at] = pack_occupied(evidence, first, beside, numbers[0], numbers[1], bits)
            ground[at] = find_ground(columns[at], evidence, first, lowest, grounds)
            peaks[at] = greatest(whole, first, depth)


@compiled
def read_solid(points, shape, layout, numbers, bits, columns, most, solid):
    """`cobstacles.solid_levels`, with the most points that a column within `beside` has anywhere.

    Few voxels have much fewer points than that: only those are looked at one by one for what leaks into them.
    """
    (height, width, depth, margin, across), (_, _, beside, _) = shape, layout
    share, solid_points, below_points = numbers[1], numbers[2], numbers[3]
    dense, around = masks_of(len(columns)), masks_of(len(columns))
    for i in range(height):
        for j in range(width):
            first, at = (i * width + j) * depth, (i + margin) * across + j + margin
            candidates = columns[at] & pack(points, first, solid_points, bits)
            if not candidates:
                continue
            bound = share * most[at - beside * (across + 1)]
            whole = columns[at] & pack(points, first, max(bound, solid_points), bits)
            if whole != candidates:
                for z in range(depth):
                    here = points[first + z]
                    if not candidates & ~whole & bits[z] or here < solid_points:
                        continue
                    if here >= share * most_beside(points, z, i, j, height, width, depth, beside):
                        whole |= bits[z]
            if below_points < INF:  # down to the first gap
                through = columns[at] & pack(points, first, below_points, bits)
                for reach in (1, 2, 4, 8, 16):
                    whole |= through & (whole >> np.uint32(reach))
                    through &= through >> np.uint32(reach)
            dense[at] = whole
            around[at] = whole | whole << np.uint32(1) | whole >> np.uint32(1)
    for i in range(margin, margin + height):
        for n in range(width):
            at = i * across + margin + n
            others = dense[at] << np.uint32(1) | dense[at] >> np.uint32(1) | around[at - 1] | around[at + 1]
            for row in (at - across, at + across):
                others |= around[row - 1] | around[row] | around[row + 1]
            solid[at] = dense[at] & others
