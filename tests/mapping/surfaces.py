"""Clouds sampled from the surfaces of known boxes."""

from __future__ import annotations

import numpy as np


def sample_surfaces(arena, spacing=0.006, noise=0.001, seed=0):
    """Points [N, 3] of the floor and of all faces of the boxes of one arena, about `spacing` [m] apart.

    What lies inside a box is left out, as is the floor under those that stand.
    """
    rng = np.random.default_rng(seed)
    boxes = [np.asarray(leaf, float) for leaf in (arena.boxes.x, arena.boxes.y, arena.boxes.yaw)]
    halves = [np.asarray(leaf, float) for leaf in (arena.boxes.half_x, arena.boxes.half_y)]
    bottoms, tops = np.asarray(arena.boxes.bottom, float), np.asarray(arena.boxes.top, float)
    used = np.flatnonzero(np.asarray(arena.boxes.used))
    size_x, size_y = np.asarray(arena.size_xy, float)
    parts = [patch(rng, size_x, size_y, spacing) @ np.eye(2, 3)]
    for m in used:
        a, b, low, high = halves[0][m], halves[1][m], bottoms[m], tops[m]
        flat = patch(rng, 2 * a, 2 * b, spacing) - [a, b]
        faces = [np.column_stack([flat, np.full(len(flat), high)])]
        if low > 0:
            faces.append(np.column_stack([flat, np.full(len(flat), low)]))
        for side in (-1, 1):
            along = patch(rng, 2 * a, high - low, spacing) - [a, -low]
            faces.append(np.column_stack([along[:, 0], np.full(len(along), side * b), along[:, 1]]))
            along = patch(rng, 2 * b, high - low, spacing) - [b, -low]
            faces.append(np.column_stack([np.full(len(along), side * a), along[:, 0], along[:, 1]]))
        points = np.concatenate(faces)
        cos, sin = np.cos(boxes[2][m]), np.sin(boxes[2][m])
        x, y = points[:, 0], points[:, 1]
        parts.append(np.column_stack([boxes[0][m] + cos * x - sin * y, boxes[1][m] + sin * x + cos * y, points[:, 2]]))
    points = np.concatenate(parts)
    hidden = np.zeros(len(points), bool)
    for m in used:
        dx, dy = points[:, 0] - boxes[0][m], points[:, 1] - boxes[1][m]
        cos, sin = np.cos(boxes[2][m]), np.sin(boxes[2][m])
        inside = (np.abs(cos * dx + sin * dy) < halves[0][m] - 1e-9) & (
            np.abs(-sin * dx + cos * dy) < halves[1][m] - 1e-9
        )
        low = bottoms[m] + 1e-9 if bottoms[m] > 0 else -1.0
        hidden |= inside & (points[:, 2] > low) & (points[:, 2] < tops[m] - 1e-9)
    points = points[~hidden]
    inside = (points[:, :2] >= 0).all(1) & (points[:, :2] <= [size_x, size_y]).all(1)
    return points[inside] + noise * rng.normal(size=(inside.sum(), 3))


def patch(rng, width, height, spacing):
    """Points of the rectangle [0, width] x [0, height], one in each square of side `spacing`."""
    n, m = max(int(width / spacing), 1), max(int(height / spacing), 1)
    u, v = np.meshgrid(np.arange(n), np.arange(m))
    jitter = rng.random((n * m, 2))
    return (np.column_stack([u.ravel(), v.ravel()]) + jitter) * [width / n, height / m]
