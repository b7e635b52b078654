"""Sensing, localisation and odometry for one arena in plain NumPy: the oracle of `jaxbiped.sensing`.

Written for being read: depth by the slab method in metres, occlusion by comparing all pairs of a row, the filter in
float64 matrices. Random numbers come from the same hash, so that decisions on them can be compared one by one.
The same words and arguments as in `jaxbiped.sensing`, whose pytrees hold NumPy arrays here.
"""

from __future__ import annotations

import numpy as np

from jaxbiped.arenas.arena import SQUARE
from jaxbiped.geometry.pose import Pose
from jaxbiped.localisation import Belief
from jaxbiped.localisation.kalman_filter import GATE, LEAST_VARIANCE, ROUNDS
from jaxbiped.sensing import Sightings, View, counter_rng
from jaxbiped.sensing.landmarks import LANDMARK
from jaxbiped.sensing.noise import ATTITUDE, HIDING_REACH, MATCH, PHANTOM, PHANTOM_BLOCK
from jaxbiped.sensing.odometry import ODOMETRY

f32 = np.float32


def rotation(axis: str, angle: float) -> np.ndarray:
    """Rotation about a frame's axis."""
    c, s = np.cos(angle), np.sin(angle)
    rows = {"x": [[1, 0, 0], [0, c, -s], [0, s, c]], "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]]}
    return np.array(rows.get(axis, [[c, -s, 0], [s, c, 0], [0, 0, 1]]), f32)


def camera_pose(pose, camera, look=False, squat=False, roll=0.0, pitch=0.0):
    """World position and rotation of the camera."""
    down = camera.look_pitch if look else camera.pitch
    height = camera.height - (camera.squat_drop if squat else 0)
    level = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], f32)  # camera axes of a camera that looks ahead
    robot = rotation("z", pose.yaw) @ rotation("y", pitch) @ rotation("x", roll)
    position = np.array([pose.x, pose.y, pose.z], f32) + robot @ np.array([camera.forward, 0, height], f32)
    return position.astype(f32), (robot @ rotation("y", down) @ level).astype(f32)


def ray_box(origin, directions, boxes, m):
    """Parameter at which each ray [R, 3] enters box m: inf for a miss, 0 from inside."""
    to_box = rotation("z", -boxes.yaw[m])
    middle = np.array([boxes.x[m], boxes.y[m], (boxes.bottom[m] + boxes.top[m]) / 2])
    half = np.array([boxes.half_x[m], boxes.half_y[m], (boxes.top[m] - boxes.bottom[m]) / 2])
    o, d = to_box @ (origin - middle), directions @ to_box.T
    with np.errstate(divide="ignore", invalid="ignore"):
        near, far = (-half * np.sign(d) - o) / d, (half * np.sign(d) - o) / d
    parallel = d == 0
    within = np.abs(o) <= half
    near, far = (
        np.where(parallel, np.where(within, -np.inf, np.inf), near),
        np.where(parallel, np.where(within, np.inf, -np.inf), far),
    )
    enter, leave = near.max(1), far.min(1)
    return np.where((enter <= leave) & (leave > 0), np.maximum(enter, 0), np.inf)


def ray_floor(origin, directions, size_xy):
    """Parameter at which each ray meets the arena's floor, else inf."""
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -origin[2] / directions[:, 2]
        hit = origin[:2] + t[:, None] * directions[:, :2]
        good = (origin[2] > 0) & (directions[:, 2] < 0) & np.all((hit >= 0) & (hit <= size_xy), axis=1)
    return np.where(good, t, np.inf)


def cast(arena, origin, basis, x, y):
    """Depth and texture contrast of what each ray (x, y, 1) of the camera meets."""
    directions = np.stack([x, y, np.ones_like(x)], axis=1) @ basis.T
    depth, contrast = ray_floor(origin, directions, arena.size_xy), np.full(len(x), arena.floor_contrast)
    for m in np.flatnonzero(arena.boxes.used):
        t = ray_box(origin, directions, arena.boxes, m)
        contrast = np.where(t < depth, arena.boxes.contrast[m], contrast)
        depth = np.minimum(depth, t)
    return depth, contrast


def measure_raycast(arena, pose, camera, noise, image, seed, look=False, squat=False):
    """The points of one view: the same slots as the package's."""
    roll, pitch = counter_rng.normal(seed, np.arange(2), ATTITUDE) * noise.attitude_sd
    origin, basis = camera_pose(pose, camera, look, squat, roll, pitch)
    across, down = image.stride
    u = np.concatenate([image.u[:1] - f32(across), image.u, image.u[-1:] + f32(across)])
    v = np.concatenate([image.v[:1] - f32(down), image.v, image.v[-1:] + f32(down)])
    x, y = (grid.astype(f32) / camera.focal for grid in np.meshgrid(u - image.centre[0], v - image.centre[1]))
    depth, contrast = cast(arena, origin, basis, x.ravel(), y.ravel())
    disparity = (camera.focal * camera.baseline / np.maximum(depth, 1e-9)).astype(f32).reshape(x.shape)
    disparity = match(disparity, contrast.reshape(x.shape)[1:-1, 1:-1], camera, image, noise, seed)

    x, y = x[1:-1, 1:-1], y[1:-1, 1:-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = camera.focal * camera.baseline / disparity
        valid = depth * np.sqrt(1 + x * x + y * y) <= noise.max_range
    depth = np.where(valid, depth, 0)
    height, basis = camera_pose(type(pose)(*np.zeros(4, f32)), camera, look, squat)
    points = np.stack([x * depth, y * depth, depth]).reshape(3, -1)
    points = np.where(valid.ravel(), basis @ points + height[:, None], 0)
    return View(*points.astype(f32), weight=np.where(valid.ravel(), f32(image.pixels_per_ray), f32(0)))


def match(disparity, contrast, camera, image, noise, seed):
    """Measured disparity of each ray, 0 where there is none; `disparity` has a margin of one ray."""
    shape = (image.rows, image.columns)
    d = disparity[1:-1, 1:-1]
    u = np.broadcast_to(image.u, shape)
    to_left, to_right = disparity[1:-1, :-2] - d, disparity[1:-1, 2:] - d
    to_up, to_down = disparity[:-2, 1:-1] - d, disparity[2:, 1:-1] - d

    def slope(before, after, stride):
        agree = np.sign(before) * np.sign(after) < 0
        return np.where(agree, np.minimum(np.abs(before), np.abs(after)), 0) / f32(stride)

    across, along = slope(to_left, to_right, image.stride[0]), slope(to_up, to_down, image.stride[1])
    bend_across, bend_along = np.abs(to_left + to_right), np.abs(to_up + to_down)
    edge = (bend_across > noise.edge_jump) | (bend_along > noise.edge_jump)
    grazing = (across > noise.grazing_slope) | (along > noise.grazing_slope)
    grazing |= (across > noise.grazing_rise) & (to_right > to_left)

    reach = 1
    while reach * image.stride[0] < HIDING_REACH:
        reach *= 2
    at = u - d
    hidden = np.zeros(shape, bool)
    for i in range(image.columns):
        hidden[:, i] = (at[:, i + 1 : i + 1 + reach] <= at[:, i : i + 1]).any(axis=1)
    near = d > camera.max_disparity

    seed_of_match = counter_rng.fold(seed, MATCH)
    chance = counter_rng.bits(seed_of_match, np.arange(d.size, dtype=np.uint32).reshape(shape))
    first, second = (chance & np.uint32(0xFFFF)) / 65536, (chance >> np.uint32(16)) / 65536
    lost = np.full(shape, noise.drop_plain)
    lost[edge] = noise.drop_edge
    lost[grazing] = noise.drop_grazing
    if noise.stretch_kept is not None:
        width = np.where(to_right > to_left, 1 - across, 1 + across)  # in the right image, of a pixel of the left one
        stretch = np.maximum(width, 1 / np.maximum(width, f32(1e-2))) - 1
        stretch[width < 1e-2] = 100
        share = np.clip((stretch - noise.stretch_kept) / (noise.stretch_lost - noise.stretch_kept), 0, 1)
        lost = np.maximum(lost, noise.drop_grazing * share)
    dropped, swapped = first < lost, edge & (second < noise.edge_swap)
    other = np.where(
        bend_across > bend_along,
        np.where(np.abs(to_left) > np.abs(to_right), to_left, to_right),
        np.where(np.abs(to_up) > np.abs(to_down), to_up, to_down),
    )

    r = max(float(noise.correlation), 1e-6)
    c = f32((1 - np.sqrt(max(1 - 4 * r * r, 0))) / (2 * r))
    white = counter_rng.normal(seed_of_match, np.arange((shape[0] + 1) * (shape[1] + 1), dtype=np.uint32), 1)
    white = white.reshape(shape[0] + 1, shape[1] + 1)
    white = white[:, :-1] + c * white[:, 1:]
    white = (white[:-1] + c * white[1:]) / (1 + c * c)
    measured = d + np.where(swapped, other, 0) + noise.bias + noise.sd * (1 + noise.slope_gain * across) * white

    block = (image.v // PHANTOM_BLOCK)[:, None] * (image.width // PHANTOM_BLOCK + 1) + image.u // PHANTOM_BLOCK
    clump = counter_rng.bits(counter_rng.fold(seed, PHANTOM), block.astype(np.uint32))
    wild = 1 + (clump & np.uint32(0xFFFF)) / 65536 * (camera.max_disparity - 1)
    share = np.where(near, noise.phantom_near, np.where(hidden, noise.phantom_hidden, 0))
    phantom = (clump >> np.uint32(16)) / 65536 < share
    measured = np.where(phantom, wild, measured).astype(f32)
    if noise.quantum > 0:
        measured = np.round(measured / noise.quantum) * noise.quantum
    good = phantom | ~(hidden | near | dropped)
    good &= (measured > 0) & (measured <= camera.max_disparity) & (measured <= u)
    return np.where(good & (contrast >= noise.min_contrast) & (d > 0), measured, 0).astype(f32)


def sight_landmarks(arena, pose, camera, noise, image, seed, look=False, squat=False):
    """Which landmarks are seen, and where."""
    marks = arena.landmarks
    origin, basis = camera_pose(pose, camera, look, squat)
    error = counter_rng.normal(seed, np.arange(2 * len(marks.x)), LANDMARK).reshape(2, -1)
    result = np.zeros((3, len(marks.x)), f32)
    seen = np.zeros(len(marks.x), bool)
    for k in np.flatnonzero(marks.used):
        offset = np.array([marks.x[k], marks.y[k], 0]) - origin
        right, down, depth = basis.T @ offset
        if not depth > 0:
            continue
        u, v = camera.focal * right / depth + image.centre[0], camera.focal * down / depth + image.centre[1]
        d = camera.focal * camera.baseline / depth
        if d > camera.max_disparity or not 0 <= v <= image.height - 1 or u - d < 0 or u > image.width - 1:
            continue
        used = np.flatnonzero(arena.boxes.used)
        if any(ray_box(origin, offset[None], arena.boxes, m)[0] < 1 - 1e-3 for m in used):
            continue
        place = rotation("z", pose.yaw)[:2, :2].T @ np.array([marks.x[k] - pose.x, marks.y[k] - pose.y])
        far = np.hypot(*place)
        if far < noise.nearest or far > (noise.furthest_square if marks.kind[k] == SQUARE else noise.furthest_circle):
            continue
        sd = noise.sd + noise.sd_per_metre * far
        result[:, k], seen[k] = (*(place + sd * error[:, k]), sd), True
    return Sightings(*result, seen=seen)


def predict(belief, dx, dy, dyaw, variances):
    """The belief after a displacement in the robot frame, in float64."""
    mean, cov = mean_of(belief), np.asarray(belief.cov, float)
    G = rotation("z", mean[2]).astype(float)
    step = G @ np.array([dx, dy, dyaw], float)
    F = np.eye(3)
    F[:2, 2] = -step[1], step[0]
    return belief_of(mean + step, F @ cov @ F.T + G @ np.diag(np.asarray(variances, float)) @ G.T, belief.pose.z)


def correct(belief, landmarks, sightings):
    """The belief after the landmarks seen, in float64; each round linearises about the result of the last."""
    about = mean_of(belief)
    for _ in range(ROUNDS):
        mean, cov = mean_of(belief), np.asarray(belief.cov, float)
        c, s = np.cos(about[2]), np.sin(about[2])
        to_robot = np.array([[c, s], [-s, c]])
        for k in np.flatnonzero(np.asarray(sightings.seen) & np.asarray(landmarks.used)):
            x, y = to_robot @ (np.array([landmarks.x[k], landmarks.y[k]], float) - about[:2])
            H = np.column_stack([-to_robot, [y, -x]])
            off = mean - about
            off[2] = wrap(off[2])
            innovation = np.array([sightings.x[k] - x, sightings.y[k] - y], float) - H @ off
            S = H @ cov @ H.T + max(float(sightings.sd[k]) ** 2, LEAST_VARIANCE) * np.eye(2)
            if not innovation @ np.linalg.solve(S, innovation) <= GATE:
                continue
            K = cov @ H.T @ np.linalg.inv(S)
            mean, cov = mean + K @ innovation, (np.eye(3) - K @ H) @ cov
        about = mean
    return belief_of(mean, cov, belief.pose.z)


def mean_of(belief):
    """(x, y, yaw) in float64."""
    return np.array([belief.pose.x, belief.pose.y, belief.pose.yaw], float)


def belief_of(mean, cov, z):
    """A belief of a mean whose yaw may have left (-pi, pi]."""
    return Belief(Pose(mean[0], mean[1], z, wrap(mean[2])), cov)


def wrap(angle):
    """The angle in (-pi, pi]."""
    return -((-angle + np.pi) % (2 * np.pi) - np.pi)


def drift(displacement, noise, seed):
    """A displacement with its error, and the variances of that."""
    walked, turned = np.hypot(displacement[0], displacement[1]), abs(displacement[2])
    yaw = noise.yaw_walked**2 * walked + noise.yaw_turned**2 * turned
    variances = np.array([noise.forward**2 * walked, noise.lateral**2 * walked, yaw], f32)
    error = np.sqrt(variances) * counter_rng.normal(seed, np.arange(3), ODOMETRY)
    return tuple(part + e for part, e in zip(displacement, error, strict=True)), variances


def measure_oracle(arena, pose, size_xy, spacing=0.025, level_height=0.03, levels=15, weight=16.0):
    """The points of the whole arena; only those that are there, in another order than the package's."""
    points = []
    boxes = arena.boxes
    for x in (np.arange(round(size_xy[0] / spacing)) + 0.5) * spacing:
        for y in (np.arange(round(size_xy[1] / spacing)) + 0.5) * spacing:
            ground, below, above = 0.0, np.inf, -np.inf
            for m in np.flatnonzero(boxes.used):
                along, across = rotation("z", -boxes.yaw[m])[:2, :2] @ (x - boxes.x[m], y - boxes.y[m])
                if abs(along) <= boxes.half_x[m] and abs(across) <= boxes.half_y[m]:
                    if boxes.overhead[m]:
                        below, above = min(below, boxes.bottom[m]), max(above, boxes.top[m])
                    else:
                        ground = max(ground, boxes.top[m])
            points.append((x, y, ground, 2 * weight))
            for z in np.arange(levels) * level_height:
                if z < ground - level_height / 2 - 1e-9:
                    points.append((x, y, z, weight))
                elif z + level_height / 2 > below and z - level_height / 2 <= above:
                    points.append((x, y, min(max(z, below), above), weight))
    x, y, z, weights = np.array(points).T - np.array([[pose.x], [pose.y], [pose.z], [0.0]])
    c, s = np.cos(pose.yaw), np.sin(pose.yaw)
    return View(*(axis.astype(f32) for axis in (c * x + s * y, c * y - s * x, z)), weight=weights.astype(f32))
