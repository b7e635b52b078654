"""Sums, the greatest, and unions over the cells near each."""

import numpy as np

from jaxbiped.core.xla_ffi import compiled as compiled

U = np.uint64
INF = np.float32(np.inf)


@compiled
def numbers_of(size, value):
    """float32 [size], each of them `value`. (NumPy's own functions take Numba longer to compile.)"""
    made = np.empty(size, np.float32)
    for n in range(U(size)):
        made[n] = value
    return made


@compiled
def masks_of(size):
    """uint32 [size], zeros."""
    made = np.empty(size, np.uint32)
    for n in range(U(size)):
        made[n] = np.uint32(0)
    return made


@compiled
def greater_of(first, at, second, there, size, result, to):
    """The greater, entry by entry, of so many from places `at` and `there` on."""
    at, there, to = U(at), U(there), U(to)
    for n in range(U(size)):
        a, b = first[at + n], second[there + n]
        result[to + n] = a if a > b else b


@compiled
def unite(first, at, second, there, size, result, to):
    """The same of masks: all bits of both."""
    at, there, to = U(at), U(there), U(to)
    for n in range(U(size)):
        result[to + n] = first[at + n] | second[there + n]


@compiled
def greatest_within(values, reach, across, room, other):
    """`relief.greatest_within` of cells none below 0: the greatest of each square, at its first corner."""
    for shift in (1, across):
        width = 1
        while width < 2 * reach + 1:
            step = min(width, 2 * reach + 1 - width)
            greater_of(values, 0, values, step * shift, len(values) - step * shift, room, 0)
            values, room, other, width = room, other, room, width + step
    return values


@compiled
def sum_patches(planes, start, height, width, depth, aside, room, result):
    """`grid.patch_sum` of planes [H, W, Z] from `start` on, in the same order: rows first, from the first on."""
    across, row = (width + 2 * aside) * depth, U(width * depth)
    if not aside:
        for n in range(U(height) * row):
            result[n] = planes[U(start) + n]
        return
    for n in range(U(height * across)):
        room[n] = np.float32(0)
    for n in range(U(height) * row):
        result[n] = np.float32(0)
    for i in range(height):
        to = U(i * across + aside * depth)
        for a in range(max(i - aside, 0), min(i + aside + 1, height)):
            at = U(start + a * width * depth)
            for n in range(row):
                room[to + n] += planes[at + n]
    for i in range(height):
        to = U(i * width * depth)
        for b in range(2 * aside + 1):
            at = U(i * across + b * depth)
            for n in range(row):
                result[to + n] += room[at + n]


@compiled
def greatest_around(values, at, across):
    """`relief.neighbours`, the greatest of the eight."""
    most = max(values[at - 1], values[at + 1])
    for row in (at - across, at + across):
        most = max(most, values[row - 1], values[row], values[row + 1])
    return most


@compiled
def dilate(source, shape, reaches, combine, line, sides, room, result):
    """`cobstacles.dilate` by a disc that goes `reaches` [R] cells along the row so many rows away; below 0: nowhere.

    The last four arrays are room for it, filled with what changes nothing; the result is in one of them.
    """
    height, _, _, margin, across = shape
    first, size, grown = margin * across, height * across, 0
    for n in range(U(len(source))):
        line[n] = source[n]
    for rows in range(len(reaches) - 1, -1, -1):
        if reaches[rows] < 0:
            continue
        while grown < reaches[rows]:
            grown += 1  # what this makes of the margins at the sides, nobody reads
            combine(source, first - grown, source, first + grown, size, sides, first)
            combine(sides, first, line, first, size, room, first)
            line, room = room, line
        combine(line, first - rows * across, line, first + rows * across, size, sides, first)
        combine(sides, first, result, first, size, room, first)
        result, room = room, result
    return result
