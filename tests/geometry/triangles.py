"""A height field as its triangles, in plain NumPy and double precision: the oracle of heights and rays."""

from __future__ import annotations

import numpy as np


def triangles(heights: np.ndarray, pitch: float) -> np.ndarray:
    """Corners [T, 3, 3] of all triangles without a hole; vertex (0, 0) stands at the origin."""
    rows, columns = heights.shape
    found = []
    for i in range(rows - 1):
        for j in range(columns - 1):
            for corners in (((i, j), (i, j + 1), (i + 1, j + 1)), ((i, j), (i + 1, j + 1), (i + 1, j))):
                found.append([(b * pitch, a * pitch, heights[a, b]) for a, b in corners])
    found = np.array(found)
    return found[np.isfinite(found).all((1, 2))]


def cast_all(corners: np.ndarray, start: np.ndarray, to: np.ndarray) -> np.ndarray:
    """Distance, in lengths of `to`, to the nearest of the triangles; inf for none. By solving for each of them."""
    best = np.full(len(start), np.inf)
    slack = 1e-9
    for a, b, c in corners:
        edge1, edge2 = b - a, c - a
        normal = np.cross(edge1, edge2)
        along = to @ normal
        with np.errstate(divide="ignore", invalid="ignore"):
            t = ((a - start) @ normal) / along
            point = start + t[:, None] * to - a
            # barycentric coordinates of a point of the plane
            d11, d12, d22 = edge1 @ edge1, edge1 @ edge2, edge2 @ edge2
            p1, p2 = point @ edge1, point @ edge2
            u, v = (d22 * p1 - d12 * p2, d11 * p2 - d12 * p1) / (d11 * d22 - d12 * d12)
            hit = (t >= 0) & (u >= -slack) & (v >= -slack) & (u + v <= 1 + slack)
        best = np.where(hit & (t < best), t, best)
    return best


def height_at(heights: np.ndarray, pitch: float, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Height at points of the plane through three vertices; NaN outside and in holes. One point after the other."""
    rows, columns = heights.shape
    found = np.full(np.shape(x), np.nan)
    for n, (u, v) in enumerate(zip(np.asarray(x) / pitch, np.asarray(y) / pitch, strict=True)):
        if not (0 <= u <= columns - 1 and 0 <= v <= rows - 1):
            continue
        i, j = min(int(v), rows - 2), min(int(u), columns - 2)
        third = (i, j + 1) if u - j >= v - i else (i + 1, j)
        plane = np.array([(b, a, 1.0) for a, b in ((i, j), third, (i + 1, j + 1))])
        level = np.array([heights[a, b] for a, b in ((i, j), third, (i + 1, j + 1))])
        if np.isfinite(level).all():
            found[n] = np.linalg.solve(plane, level) @ (u, v, 1.0)
    return found
