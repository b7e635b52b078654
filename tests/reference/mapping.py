"""The mapping room in plain NumPy, one arena at a time: voxels are Booleans, obstacles grow cell by cell.

The same words and arguments as in `jaxbiped.mapping`, whose pytrees may hold NumPy arrays here. Single precision where
a point must fall into the same voxel.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jaxbiped.mapping.grid import Cell
from jaxbiped.mapping.gridmap import FOOTPRINT_POINTS, GridMap
from jaxbiped.mapping.leveling import PIXEL_SD, PRIOR_OFFSET, PRIOR_PIXELS, PRIOR_SLOPE, ROUNDS, SAMPLE
from jaxbiped.sensing.view import View


def empty(spec):
    shape = spec.shape
    return GridMap(*(np.zeros((*shape, n), np.float32) for n in (spec.levels, 4, spec.ground_levels)))


def update(grid_map, view, pose, body, params, spec, refit=True):
    if refit:
        view = level_view(view, int(np.round(pose.z / np.float32(spec.level_height))), params, spec)
    points = voxelise(view, pose, params, spec)
    points[points < params.voxel_points * np.float32(spec.cell_share)] = 0
    evidence = grid_map.evidence + points
    count = points.sum(-1)
    count[count < params.view_points * np.float32(spec.cell_share)] = 0
    return add_votes(replace(grid_map, evidence=evidence), count, *c_obstacles(evidence, body, params, spec))


def voxelise(view, pose, params, spec):
    (height, width), depth = spec.shape, spec.levels
    numbers = np.stack([view.x, view.y, view.z, view.weight]).astype(np.float32)
    x, y, z, weight = numbers[:, np.isfinite(numbers).all(0) & (numbers[3] > 0)]
    with np.errstate(over="ignore"):
        near = x**2 + y**2 < np.float32(params.max_range) ** 2
    x, y, z, weight = x[near], y[near], z[near], weight[near]
    cos, sin = np.cos(np.float32(pose.yaw)), np.sin(np.float32(pose.yaw))
    world_x, world_y = pose.x + cos * x - sin * y, pose.y + sin * x + cos * y
    pitch, rise = np.float32(spec.pitch), np.float32(spec.level_height)
    index = np.stack(
        [np.floor(world_y / pitch), np.floor(world_x / pitch), np.round((z + pose.z) / rise) - spec.lowest]
    )
    inside = ((index >= 0) & (index < np.array([[height], [width], [depth]]))).all(0)
    flat = np.ravel_multi_index(index[:, inside].astype(int), (height, width, depth))
    sums = np.bincount(flat, weight[inside], height * width * depth)
    return sums.reshape(height, width, depth).astype(np.float32)


def add_votes(grid_map, count, classes, levels):
    votes, level_votes = grid_map.votes.copy(), grid_map.level_votes.copy()
    i, j = np.indices(count.shape)
    votes[i, j, classes - 1] += count
    level_votes[i, j, levels] += count
    return replace(grid_map, votes=votes, level_votes=level_votes)


def c_obstacles(evidence, body, params, spec):
    """Classes and ground levels; rules as in the package."""
    least = np.full(evidence.shape, params.voxel_points * np.float32(spec.cell_share), np.float32)
    least[..., 1:] = np.maximum(least[..., 1:], params.voxel_share * evidence[..., :-1])
    least[..., :-1] = np.maximum(least[..., :-1], params.voxel_share * evidence[..., 1:])
    voxels = (evidence > 0) & (evidence >= least)
    occupied = voxels[..., -spec.lowest :].copy()  # by level, from 0
    occupied[..., 0] = voxels[..., : 1 - spec.lowest].any(-1)
    ground = ground_level(occupied, evidence, spec)
    return read_cells(solid_levels(voxels, evidence, params, spec), ground, body, params.head_margin, spec)


def solid_levels(voxels, evidence, params, spec):
    """Occupied voxels with enough points in the patch around them, and with such a neighbour."""
    height, width = voxels.shape[:2]
    aside = 0
    while (2 * (aside + 1)) * spec.pitch <= 0.05 + 1e-9:
        aside += 1
    padded = np.pad(evidence, ((aside, aside), (aside, aside), (0, 0)))
    sides = range(2 * aside + 1)
    patch = sum(padded[i : i + height, j : j + width] for i in sides for j in sides)
    dense = (voxels & (patch >= params.solid_points))[..., -spec.lowest :]
    dense[..., 0] |= (voxels & (patch >= params.solid_points))[..., : 1 - spec.lowest].any(-1)
    if params.below_points is not None:
        enough = voxels & (patch >= params.below_points)
        through = enough[..., -spec.lowest :].copy()
        through[..., 0] |= enough[..., : 1 - spec.lowest].any(-1)
        for level in range(dense.shape[-1] - 2, -1, -1):
            dense[..., level] |= through[..., level] & dense[..., level + 1]
    padded = np.pad(dense, 1)
    around = sum(
        padded[i : i + height, j : j + width, k : k + dense.shape[-1]].astype(int)
        for i in range(3)
        for j in range(3)
        for k in range(3)
    )
    return dense & (around > 1)  # itself and another


def ground_level(occupied, evidence, spec):
    first = occupied.argmax(-1)  # lowest occupied level
    levels = np.arange(occupied.shape[-1])
    gap = ~occupied & (levels >= first[..., None])
    end = np.where(gap.any(-1), gap.argmax(-1), occupied.shape[-1])  # first free level above the run
    run = (levels >= first[..., None]) & (levels < end[..., None])
    stands = run[..., : spec.ground_levels] * evidence[..., -spec.lowest : spec.ground_levels - spec.lowest]
    return np.where(occupied.any(-1) & (end <= spec.ground_levels), stands.argmax(-1), 0)


def read_cells(occupied, ground, body, head_margin, spec):
    near = dilate(occupied, body.radius, spec)
    lower_face = (np.arange(occupied.shape[-1], dtype=np.float32) - np.float32(0.5)) * np.float32(spec.level_height)
    above_step = lower_face >= body.step
    classes = np.where(ground > 0, Cell.BUMP, Cell.FLOOR)
    for level in range(spec.ground_levels):
        span = near[..., level:]  # relative to this ground
        faces, above = lower_face[: span.shape[-1]], above_step[: span.shape[-1]]
        standing = span[..., above & (faces < body.standing)].any(-1)
        squatting = span[..., above & (faces + np.float32(head_margin) < body.squatting)].any(-1)
        classes[(ground == level) & standing] = Cell.GATE
        classes[(ground == level) & squatting] = Cell.OBSTACLE
    return classes.astype(np.int8), ground.astype(np.int8)


def dilate(occupied, radius, spec):
    """Whether a voxel of a level is occupied in a cell or in one whose square comes nearer than the radius."""
    height, width = occupied.shape[:2]
    reach = int(spec.max_radius / spec.pitch + 1)
    padded = np.pad(occupied, ((reach, reach), (reach, reach), (0, 0)))
    near = occupied.copy()
    for di in range(-reach, reach + 1):
        for dj in range(-reach, reach + 1):
            away = np.array([max(abs(di) - 0.5, 0), max(abs(dj) - 0.5, 0)], np.float32) * np.float32(spec.pitch)
            if max(away) < spec.max_radius and (away**2).sum() < np.float32(radius) ** 2:
                near |= padded[reach + di : reach + di + height, reach + dj : reach + dj + width]
    return near


def classify(grid_map, params, spec):
    classes = 4 - grid_map.votes[..., ::-1].argmax(-1)
    level = grid_map.level_votes.argmax(-1)
    if spec.ground_levels > 1:
        level = np.where(classes == Cell.BUMP, 1 + grid_map.level_votes[..., 1:].argmax(-1), level)
    level[classes == Cell.FLOOR] = 0
    unmeasured = grid_map.votes.sum(-1) < params.fused_points * np.float32(spec.cell_share)
    classes[unmeasured], level[unmeasured] = Cell.UNMEASURED, 0
    return classes.astype(np.int8), level.astype(np.int8)


def mark_footprint(grid_map, x, y, level, radius, spec):
    rows, columns = spec.shape
    count = np.zeros(spec.shape, np.float32)
    for i in range(rows):
        for j in range(columns):
            dx, dy = (np.float32((k + 0.5) * spec.pitch - at) for k, at in ((j, x), (i, y)))
            if dx**2 + dy**2 <= np.float32(radius) ** 2 or max(abs(dx), abs(dy)) <= spec.pitch / 2:
                count[i, j] = FOOTPRINT_POINTS * spec.cell_share
    level = min(max(level, 0), spec.ground_levels - 1)
    evidence = grid_map.evidence.copy()
    evidence[..., level - spec.lowest] += count
    kind = Cell.BUMP if level else Cell.FLOOR
    return add_votes(replace(grid_map, evidence=evidence), count, *np.full((2, *spec.shape), [[[kind]], [[level]]]))


def level_view(view, support, params, spec):
    """Floor-plane refit by `numpy.linalg.lstsq` in double precision; the package's rounds and prior."""
    numbers = np.stack([view.x, view.y, view.z, view.weight]).astype(float)
    stride = max(1, numbers.shape[1] // SAMPLE)
    stride += stride % 2 == 0
    numbers = numbers[:, ::stride]
    x, y, z, pixels = numbers[:, np.isfinite(numbers).all(0) & (numbers[3] > 0)]
    pixels = pixels * stride
    features = np.stack([np.ones_like(x), x, y], -1)
    grounds = np.arange(spec.ground_levels) - support  # relative to where the robot stands

    def off_level(plane):
        above = z - features @ plane
        nearest = grounds[np.abs(above[:, None] - grounds * spec.level_height).argmin(1)] * spec.level_height
        return above - nearest, nearest

    prior = np.diag(PIXEL_SD * np.sqrt(PRIOR_PIXELS) / np.array([PRIOR_OFFSET, PRIOR_SLOPE, PRIOR_SLOPE]))
    plane = np.zeros(3)
    for reach, width in ROUNDS:
        residual, nearest = off_level(plane)
        weight = np.maximum(1 - (residual / (width * params.refit_inlier)) ** 2, 0) * np.sqrt(pixels)
        weight[np.hypot(x, y) >= reach] = 0
        left = np.concatenate([features * weight[:, None], prior])
        plane = np.linalg.lstsq(left, np.append((z - nearest) * weight, [0, 0, 0]))[0]

    residual, _ = off_level(plane)
    on_floor = (np.abs(residual) < params.refit_inlier) & (np.hypot(x, y) < ROUNDS[-1][0])
    steep, high = np.hypot(*plane[1:]) >= params.refit_slope, abs(plane[0]) >= params.refit_offset
    if steep or high or pixels[on_floor].sum() < params.refit_points:
        return view
    offset, slope_x, slope_y = plane
    turned = (
        view.x + slope_x * view.z,
        view.y + slope_y * view.z,
        view.z - (offset + slope_x * view.x + slope_y * view.y),
    )
    return View(*np.float32(turned), view.weight)


def truth_grid(boxes, spec, body, samples=5, least_share=0.05):
    """Classes and levels known perfectly; boxes as rows (x, y, yaw, half_x, half_y, bottom, top, overhead)."""
    (rows, columns), depth = spec.shape, spec.levels + spec.lowest
    places = np.zeros((rows, columns, samples**2, depth), bool)
    ground = np.zeros((rows, columns, samples**2), int)
    places[..., 0] = True
    sub = (np.arange(samples) + 0.5) / samples
    for x, y, yaw, half_x, half_y, bottom, top, overhead in boxes:
        px = (np.arange(columns)[None, :, None, None] + sub) * spec.pitch - x
        py = (np.arange(rows)[:, None, None, None] + sub[:, None]) * spec.pitch - y
        along, across = np.cos(yaw) * px + np.sin(yaw) * py, np.cos(yaw) * py - np.sin(yaw) * px
        here = ((np.abs(along) <= half_x) & (np.abs(across) <= half_y)).reshape(rows, columns, -1)
        first, last = round(bottom / spec.level_height) if overhead else 0, round(top / spec.level_height)
        places[here, first : last + 1] = True
        if not overhead:
            ground[here] = np.maximum(ground[here], last)
    walkable = (ground[..., None] == np.arange(spec.ground_levels)).sum(2)
    best = spec.ground_levels - 1 - walkable[..., ::-1].argmax(-1)
    level = np.where(walkable.sum(-1) >= samples**2 / 2, best, 0)
    return read_cells(places.mean(2) > least_share, level, body, 0.0, spec)
