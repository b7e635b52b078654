"""The mapping room in plain NumPy, one arena at a time: voxels are Booleans, obstacles grow cell by cell.

The same words and arguments as in `jaxbiped.mapping`, whose pytrees may hold NumPy arrays here. Single precision where
a point must fall into the same voxel.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jaxbiped.mapping.grid import Cell
from jaxbiped.mapping.gridmap import AS_GOOD, FOOTPRINT_POINTS, GridMap
from jaxbiped.mapping.leveling import (
    OFF_LEVEL,
    OWN_HEIGHT,
    PIXEL_SD,
    PLAIN,
    PRIOR_OFFSET,
    PRIOR_PIXELS,
    PRIOR_SLOPE,
    ROUNDS,
    SAMPLE,
)
from jaxbiped.mapping.relief import EDGE, FACE, SHARE, SURE, Surfaces
from jaxbiped.sensing.view import View


def empty(spec):
    zeros = [np.zeros((*spec.shape, n), np.float32) for n in (spec.levels, 4, spec.ground_levels)]
    return GridMap(*zeros, Surfaces(*np.zeros((2, spec.ground_levels, *spec.shape), np.float32)))


def update(grid_map, view, pose, body, params, spec, refit=True):
    if refit:
        view = level_view(view, pose.z, params, spec)
    voxels, above, weight, near = place(view, pose, params, spec)
    points = count_in(voxels, weight, (*spec.shape, spec.levels))
    points[points < params.voxel_points * np.float32(spec.cell_share)] = 0
    evidence = grid_map.evidence + points
    count = points.sum(-1)
    count[count < params.view_points * np.float32(spec.cell_share)] = 0
    surfaces = add_surfaces(grid_map.surfaces, voxels, above, weight * near, spec)
    classes, levels = c_obstacles(evidence, surfaces, body, params, spec)
    return add_votes(replace(grid_map, evidence=evidence, surfaces=surfaces), count, classes, levels)


def place(view, pose, params, spec):
    """Voxel (i, j, k) [3, n], height and weight of each point that counts, and how much its height does."""
    at, *rest = coordinates(view, pose, params, spec)
    index, inside = voxels_at(at, spec)
    return index[:, inside].astype(int), *(values[inside] for values in rest)


def coordinates(view, pose, params, spec):
    """(y, x, z) [3, n] in sides of a voxel of each point in range, on the grid or not; the rest as of `place`."""
    numbers = np.stack([view.x, view.y, view.z, view.weight]).astype(np.float32)
    x, y, z, weight = numbers[:, np.isfinite(numbers).all(0) & (numbers[3] > 0)]
    with np.errstate(over="ignore"):
        near = x**2 + y**2 < np.float32(params.max_range) ** 2
    x, y, z, weight = x[near], y[near], z[near], weight[near]
    cos, sin = np.cos(np.float32(pose.yaw)), np.sin(np.float32(pose.yaw))
    world_x, world_y = pose.x + cos * x - sin * y, pose.y + sin * x + cos * y
    pitch, rise = np.float32(spec.pitch), np.float32(spec.level_height)
    near = 1 / (1 + (x**2 + y**2) / np.float32(params.height_range) ** 2)
    return np.stack([world_y / pitch, world_x / pitch, (z + pose.z) / rise]), z + pose.z, weight, near


def voxels_at(at, spec):
    """Index (i, j, k) [3, n] of the voxel that holds each of `coordinates`, and whether the grid has it."""
    index = np.stack([np.floor(at[0]), np.floor(at[1]), np.round(at[2]) - spec.lowest])
    return index, ((index >= 0) & (index < np.array([*spec.shape, spec.levels])[:, None])).all(0)


def count_in(index, weight, shape):
    """Sums of weights in each element of an array."""
    sums = np.bincount(np.ravel_multi_index(index, shape), weight, np.prod(shape, dtype=int))
    return sums.reshape(shape).astype(np.float32)


def add_surfaces(surfaces, voxels, above, weight, spec, face=FACE):
    """With the points of one view, and their heights: of raised levels, without the faces below them."""
    level = np.maximum(voxels[2] + spec.lowest, 0)
    rise = above - level * np.float32(spec.level_height)
    lowest = np.full(surfaces.weight.shape, -np.inf, np.float32)
    known = surfaces.weight > 0
    lowest[known] = surfaces.rise[known] / np.maximum(surfaces.weight[known], np.float32(1e-6)) - np.float32(face)
    lowest[0] = -np.inf
    good = level < spec.ground_levels
    good[good] = rise[good] >= lowest[level[good], voxels[0, good], voxels[1, good]]
    cell = np.stack([level, *voxels[:2]])[:, good]
    added = (count_in(cell, values[good], surfaces.weight.shape) for values in (weight, weight * rise))
    return Surfaces(*(old + new for old, new in zip((surfaces.weight, surfaces.rise), added, strict=True)))


def ground_height(grid_map, ij, z, spec):
    """Height of a cell's ground as measured, at the level of z."""
    level = int(np.clip(np.round(z / np.float32(spec.level_height)), 0, spec.ground_levels - 1))
    weight, rise = grid_map.surfaces.weight[level, *ij], grid_map.surfaces.rise[level, *ij]
    off = rise / max(weight, 1e-6)
    return np.float32(level * spec.level_height + (off if abs(off) > AS_GOOD else 0.0) if weight > 0 else z)


def add_votes(grid_map, count, classes, levels):
    votes, level_votes = grid_map.votes.copy(), grid_map.level_votes.copy()
    i, j = np.indices(count.shape)
    votes[i, j, classes - 1] += count
    level_votes[i, j, levels] += count
    return replace(grid_map, votes=votes, level_votes=level_votes)


def c_obstacles(evidence, surfaces, body, params, spec):
    """Classes and ground levels; rules as in the package."""
    least = np.full(evidence.shape, params.voxel_points * np.float32(spec.cell_share), np.float32)
    least[..., 1:] = np.maximum(least[..., 1:], params.voxel_share * evidence[..., :-1])
    least[..., :-1] = np.maximum(least[..., :-1], params.voxel_share * evidence[..., 1:])
    voxels = (evidence > 0) & (evidence >= least)
    occupied = voxels[..., -spec.lowest :].copy()  # by level, from 0
    occupied[..., 0] = voxels[..., : 1 - spec.lowest].any(-1)
    ground = ground_level(occupied, evidence, spec)
    solid = solid_levels(voxels, evidence, params, spec)
    relief = read_relief(surfaces, ground, occupied, solid, params, spec)
    bears = body.step_tolerance - params.height_margin, body.height_tolerance - params.height_margin
    body = replace(body, step_tolerance=bears[0], height_tolerance=bears[1])
    return classify_cells(solid, ground, relief, body, params.head_margin, spec)


def patch_sum(values, spec):
    """Sums over the patch of about 5 x 5 cm around each cell."""
    height, width = values.shape[:2]
    aside = 0
    while (2 * (aside + 1)) * spec.pitch <= 0.05 + 1e-9:
        aside += 1
    padded = np.pad(values, ((aside, aside), (aside, aside), (0, 0)))
    rows = sum(padded[i : i + height] for i in range(2 * aside + 1))
    return sum(rows[:, j : j + width] for j in range(2 * aside + 1))


def read_relief(surfaces, ground, occupied, solid, params, spec):
    """(height, error, top) of each cell, one after the other."""
    weight, rise = (patch_sum(np.moveaxis(leaf, 0, -1), spec) for leaf in (surfaces.weight, surfaces.rise))
    many = np.maximum(weight, np.float32(1e-6))
    mean = (np.arange(spec.ground_levels) * np.float32(spec.level_height)).astype(np.float32) + rise / many
    error = np.float32(SURE) * np.float32(params.height_sd) / np.sqrt(many)
    height = ground * np.float32(spec.level_height)
    sd, top = np.zeros(ground.shape, np.float32), np.full(ground.shape, -np.inf, np.float32)
    beside = max(int(0.05 / spec.pitch + 0.5), 1)
    for i, j in np.ndindex(ground.shape):
        near = surfaces.weight[:, max(i - beside, 0) : i + beside + 1, max(j - beside, 0) : j + beside + 1]
        most = near.max((1, 2))
        for level in range(spec.ground_levels):
            if not solid[i, j, level]:
                continue
            above = level + 1 < spec.ground_levels and occupied[i, j, level + 1]
            if above and mean[i, j, level + 1] - mean[i, j, level] > np.float32(EDGE):
                continue
            if level == ground[i, j]:
                height[i, j], sd[i, j] = mean[i, j, level], error[i, j, level]
            if surfaces.weight[level, i, j] >= np.float32(SHARE) * most[level]:
                top[i, j] = mean[i, j, level] - error[i, j, level]
    alone = np.array([np.max(around(top, i, j), initial=-np.inf) for i, j in np.ndindex(top.shape)])
    return height, sd, np.minimum(top, alone.reshape(top.shape))


def around(values, i, j):
    """Those of the up to eight cells around one."""
    near = np.zeros(values.shape, bool)
    near[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2] = True
    near[i, j] = False
    return values[near]


def solid_levels(voxels, evidence, params, spec):
    """Occupied voxels with enough points in the patch around them, and with such a neighbour."""
    height, width = voxels.shape[:2]
    patch = patch_sum(evidence, spec)
    enough = voxels & (patch >= params.solid_points) & (patch >= params.voxel_share * leaking(patch, spec))
    dense = enough[..., -spec.lowest :].copy()
    dense[..., 0] |= enough[..., : 1 - spec.lowest].any(-1)
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


def leaking(patch, spec):
    """The greatest of the voxels one level higher or lower, in each column within 5 cm."""
    most = np.zeros_like(patch)
    reach = max(int(0.05 / spec.pitch + 0.5), 1)
    for i, j, k in np.ndindex(patch.shape):
        near = patch[max(i - reach, 0) : i + reach + 1, max(j - reach, 0) : j + reach + 1]
        most[i, j, k] = max(near[..., n].max() for n in (k - 1, k + 1) if 0 <= n < patch.shape[2])
    return most


def ground_level(occupied, evidence, spec):
    first = occupied.argmax(-1)  # lowest occupied level
    levels = np.arange(occupied.shape[-1])
    gap = ~occupied & (levels >= first[..., None])
    end = np.where(gap.any(-1), gap.argmax(-1), occupied.shape[-1])  # first free level above the run
    run = (levels >= first[..., None]) & (levels < end[..., None])
    stands = run[..., : spec.ground_levels] * evidence[..., -spec.lowest : spec.ground_levels - spec.lowest]
    return np.where(occupied.any(-1) & (end <= spec.ground_levels), stands.argmax(-1), 0)


def classify_cells(occupied, ground, relief, body, head_margin, spec):
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
    height, error, top = relief
    too_high = height + error + np.float32(body.step) + np.float32(body.step_tolerance)
    classes[dilate(top[..., None], body.radius, spec)[..., 0] > too_high] = Cell.OBSTACLE
    classes[is_untenable(height, error, ground, np.float32(body.height_tolerance), spec)] = Cell.OBSTACLE
    return classes.astype(np.int8), ground.astype(np.int8)


def is_untenable(height, error, ground, most, spec):
    """Whether a step into a cell ends too far off the height of its level, cell by cell."""
    off = height - ground * np.float32(spec.level_height)
    high, low = off - error, off + error
    out = np.zeros(ground.shape, bool)
    for i, j in np.ndindex(ground.shape):
        up, down = high[i, j], low[i, j]
        out[i, j] = up > most or down < -most
        out[i, j] |= up > most / 2 and up - around(low, i, j).min(initial=np.inf) > most
        out[i, j] |= down < -most / 2 and around(high, i, j).max(initial=-np.inf) - down > most
    return out


def dilate(occupied, radius, spec):
    """The greatest of each level's values in a cell and in those whose square comes nearer than the radius.

    Of Booleans: whether a voxel of the level is occupied there. Beyond the rim nothing is.
    """
    height, width = occupied.shape[:2]
    reach = int(spec.max_radius / spec.pitch + 1)
    nothing = False if occupied.dtype == bool else -np.inf
    padded = np.pad(occupied, ((reach, reach), (reach, reach), (0, 0)), constant_values=nothing)
    near = occupied.copy()
    for di in range(-reach, reach + 1):
        for dj in range(-reach, reach + 1):
            away = np.array([max(abs(di) - 0.5, 0), max(abs(dj) - 0.5, 0)], np.float32) * np.float32(spec.pitch)
            if max(away) < spec.max_radius and (away**2).sum() < np.float32(radius) ** 2:
                near = np.maximum(near, padded[reach + di : reach + di + height, reach + dj : reach + dj + width])
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


def mark_footprint(grid_map, x, y, z, radius, spec):
    rows, columns = spec.shape
    count = np.zeros(spec.shape, np.float32)
    for i in range(rows):
        for j in range(columns):
            dx, dy = (np.float32((k + 0.5) * spec.pitch - at) for k, at in ((j, x), (i, y)))
            if dx**2 + dy**2 <= np.float32(radius) ** 2 or max(abs(dx), abs(dy)) <= spec.pitch / 2:
                count[i, j] = FOOTPRINT_POINTS * spec.cell_share
    rise = np.float32(spec.level_height)
    level = int(np.clip(np.round(np.float32(z) / rise), 0, spec.ground_levels - 1))
    evidence, pixels, heights = (
        leaf.copy() for leaf in (grid_map.evidence, grid_map.surfaces.weight, grid_map.surfaces.rise)
    )
    evidence[..., level - spec.lowest] += count
    pixels[level] += count
    heights[level] += count * (np.float32(z) - level * rise)
    marked = replace(grid_map, evidence=evidence, surfaces=Surfaces(pixels, heights))
    kind = Cell.BUMP if level else Cell.FLOOR
    return add_votes(marked, count, *np.full((2, *spec.shape), [[[kind]], [[level]]]))


def level_view(view, support, params, spec, border=0.0, reaches=0.0, plain=0.0):
    """Floor-plane refit by `numpy.linalg.lstsq` in double precision; the package's rounds and prior.

    Each half level has a lift of its own as one more unknown; the second of two fits takes those that stand for more
    than noise as known, and the others for none. The last arguments [m] move the fit's thresholds: borders of half
    levels, reaches of rounds, and what is more than noise.
    """
    numbers = np.stack([view.x, view.y, view.z, view.weight]).astype(float)
    stride = max(1, numbers.shape[1] // SAMPLE)
    stride += stride % 2 == 0
    numbers = numbers[:, ::stride]
    x, y, z, pixels = numbers[:, np.isfinite(numbers).all(0) & (numbers[3] > 0)]
    pixels = pixels * stride
    features = np.stack([np.ones_like(x), x, y], -1)
    rise, count = spec.level_height / 2, 2 * spec.ground_levels - 1

    def off_level(plane, lifts):
        above = z - features @ plane
        level = np.clip(np.round((above + support - border) / rise), 0, count - 1).astype(int)
        return level, above - (level * rise - support) - lifts[level]

    def prior(*sds):
        return np.diag(PIXEL_SD * np.sqrt(PRIOR_PIXELS) / np.array(sds))

    plane, lifts = np.zeros(3), np.zeros(count)
    for reach, width in ROUNDS:
        level, residual = off_level(plane, lifts)
        weight = np.maximum(1 - (residual / (width * params.refit_inlier)) ** 2, 0) * np.sqrt(pixels)
        weight[np.hypot(x, y) >= reach + reaches] = 0
        target = z - (level * rise - support)
        both = np.concatenate([features, np.eye(count)[level]], axis=1) * weight[:, None]
        known = prior(OWN_HEIGHT, PRIOR_SLOPE, PRIOR_SLOPE, *[OFF_LEVEL] * count)
        found = np.linalg.lstsq(np.concatenate([both, known]), np.append(target * weight, np.zeros(3 + count)))[0]
        lifts = np.where(np.abs(found[3:]) > PLAIN + plain, found[3:], 0)
        left = np.concatenate([features * weight[:, None], prior(PRIOR_OFFSET, PRIOR_SLOPE, PRIOR_SLOPE)])
        plane = np.linalg.lstsq(left, np.append((target - lifts[level]) * weight, [0, 0, 0]))[0]

    _, residual = off_level(plane, lifts)
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
    heights = np.zeros((rows, columns, samples**2), np.float32)
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
            heights[here] = np.maximum(heights[here], top)
    ground = np.round(heights / np.float32(spec.level_height)).astype(int)
    walkable = (ground[..., None] == np.arange(spec.ground_levels)).sum(2)
    best = spec.ground_levels - 1 - walkable[..., ::-1].argmax(-1)
    level = np.where(walkable.sum(-1) >= samples**2 / 2, best, 0)
    own, top = level * np.float32(spec.level_height), np.full(level.shape, -np.inf, np.float32)
    for i, j in np.ndindex(level.shape):
        at, all_heights = ground[i, j], heights[i, j]
        if (at == level[i, j]).any():
            own[i, j] = all_heights[at == level[i, j]].mean()
        shares = walkable[i, j] / samples**2
        top[i, j] = max((all_heights[at == k].max() for k in np.flatnonzero(shares > least_share)), default=-np.inf)
    return classify_cells(places.mean(2) > least_share, level, (own, np.zeros_like(own), top), body, 0.0, spec)
