"""The class of each cell (`mapping.cobstacles`)."""

import numpy as np

from jaxbiped.mapping.grid import Cell
from jaxbiped.mapping.kernels.columns import read_columns, read_solid
from jaxbiped.mapping.kernels.ground import mark_untenable, read_relief
from jaxbiped.mapping.kernels.windows import (
    INF,
    compiled,
    dilate,
    greater_of,
    greatest_within,
    masks_of,
    numbers_of,
    sum_patches,
    unite,
)

FLOOR, BUMP, GATE, OBSTACLE = (np.int8(kind) for kind in (Cell.FLOOR, Cell.BUMP, Cell.GATE, Cell.OBSTACLE))


@compiled
def class_arena(evidence, weight, rise, shape, layout, numbers, heights, reaches, bands, classes, levels):
    """One arena; `classes` and `levels` are written."""
    height, width, depth, margin, across = shape
    lowest, aside, beside, _ = layout
    cells, size = height * width, (height + 2 * margin) * across
    bits = np.empty(depth, np.uint32)
    for z in range(depth):
        bits[z] = np.uint32(1) << np.uint32(max(z + lowest, 0))
    points = evidence
    if aside:
        points = np.empty(cells * depth, np.float32)
        room = np.empty(height * (width + 2 * aside) * depth, np.float32)
        sum_patches(evidence, 0, height, width, depth, aside, room, points)
    columns, solid, ground, untenable = masks_of(size), masks_of(size), masks_of(size), masks_of(size)
    peaks = numbers_of(size, np.float32(0))
    read_columns(evidence, shape, layout, numbers, bits, points, columns, ground, peaks)
    most = greatest_within(peaks, beside, across, np.empty(size, np.float32), np.empty(size, np.float32))
    read_solid(points, shape, layout, numbers, bits, columns, most, solid)
    height_of, error_of, top = numbers_of(size, INF), numbers_of(size, INF), numbers_of(size, -INF)
    read_relief(weight, rise, shape, layout, numbers[4], heights, columns, ground, solid, height_of, error_of, top)
    mark_untenable(height_of, error_of, shape, numbers, heights, ground, untenable)
    near = dilate(solid, shape, reaches, unite, masks_of(size), masks_of(size), masks_of(size), masks_of(size))
    low = numbers_of(size, -INF), numbers_of(size, -INF), numbers_of(size, -INF), numbers_of(size, -INF)
    highest = dilate(top, shape, reaches, greater_of, low[0], low[1], low[2], low[3])
    for i in range(height):
        for j in range(width):
            at, cell = (i + margin) * across + j + margin, i * width + j
            level = np.uint32(ground[at])
            kind = BUMP if level else FLOOR
            if near[at] & (np.uint32(bands[1]) << level):
                kind = GATE
            if near[at] & (np.uint32(bands[0]) << level) or untenable[at]:
                kind = OBSTACLE
            if highest[at] > height_of[at] + error_of[at] + numbers[5] + numbers[6]:
                kind = OBSTACLE
            classes[cell], levels[cell] = kind, level
