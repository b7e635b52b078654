"""The heights of the ground (`mapping.relief`)."""

import numpy as np

from jaxbiped.mapping.kernels.windows import (
    INF,
    U,
    compiled,
    greatest_around,
    greatest_within,
    masks_of,
    numbers_of,
    sum_patches,
)
from jaxbiped.mapping.relief import EDGE, SHARE

EDGE_32, SHARE_32, FEWEST = np.float32(EDGE), np.float32(SHARE), np.float32(1e-6)


@compiled
def read_relief(weight, rise, shape, layout, variance, heights, columns, ground, solid, height_of, error_of, top):
    """`relief.read_relief`: height and error of each cell's ground, and how high it is at least."""
    (height, width, _, margin, across), (_, aside, beside, grounds) = shape, layout
    cells, size = height * width, len(top)
    values, room, other = numbers_of(size, np.float32(0)), np.empty(size, np.float32), np.empty(size, np.float32)
    many, total = np.empty(cells, np.float32), np.empty(cells, np.float32)
    wide = np.empty(height * (width + 2 * aside), np.float32)
    means, errors = np.empty(grounds * cells, np.float32), np.empty(grounds * cells, np.float32)
    is_top = masks_of(grounds * cells)
    for level in range(grounds):
        start = level * cells
        for i in range(height):
            to, at = U((i + margin) * across + margin), U(start + i * width)
            for n in range(U(width)):
                values[to + n] = weight[at + n]
        most = greatest_within(values, beside, across, room, other)
        for i in range(height):
            to, at = U(start + i * width), U((i + margin - beside) * across + margin - beside)
            for n in range(U(width)):
                is_top[to + n] = np.uint32(weight[to + n] >= SHARE_32 * most[at + n])
        sum_patches(weight, start, height, width, 1, aside, wide, many)
        sum_patches(rise, start, height, width, 1, aside, wide, total)
        for n in range(U(cells)):
            pixels = many[n] if many[n] > FEWEST else FEWEST
            means[U(start) + n] = heights[level] + total[n] / pixels
            errors[U(start) + n] = np.sqrt(variance / pixels)
    own = numbers_of(size, -INF)
    for i in range(height):
        for j in range(width):
            cell, at = i * width + j, (i + margin) * across + j + margin
            height_of[at], error_of[at] = heights[ground[at]], 0
            for level in range(grounds):
                n, above = level * cells + cell, np.uint32(level + 1)
                if not (solid[at] >> np.uint32(level)) & np.uint32(1):
                    continue
                has_above = level + 1 < grounds and (columns[at] >> above) & np.uint32(1)
                if has_above and means[n + cells] - means[n] > EDGE_32:
                    continue
                if level == ground[at]:
                    height_of[at], error_of[at] = means[n], errors[n]
                if is_top[n]:
                    own[at] = means[n] - errors[n]
    for i in range(margin, margin + height):
        for n in range(width):
            at = i * across + margin + n
            top[at] = min(own[at], greatest_around(own, at, across))


@compiled
def mark_untenable(height_of, error_of, shape, numbers, heights, ground, untenable):
    """`relief.is_untenable`."""
    (height, width, _, margin, across), most, half = shape, numbers[7], numbers[8]
    high = numbers_of(len(ground), -INF)  # surely at least
    low = numbers_of(len(ground), -INF)  # surely at most, its negative
    for i in range(margin, margin + height):
        for n in range(width):
            at = i * across + margin + n
            error = height_of[at] - heights[ground[at]]
            high[at], low[at] = error - error_of[at], -(error + error_of[at])
    for i in range(margin, margin + height):
        for n in range(width):
            at = i * across + margin + n
            off = high[at] > most or low[at] > most
            if high[at] > half:
                off = off or high[at] + greatest_around(low, at, across) > most
            if low[at] > half:
                off = off or low[at] + greatest_around(high, at, across) > most
            untenable[at] = np.uint32(off)
