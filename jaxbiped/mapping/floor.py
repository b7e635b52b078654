"""The floor in a cloud of points, and with it the direction of gravity: a robust plane.

Host code in float64: clouds may lie far from their origin and hold millions of points.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

MOST_PLACES = 30_000  # that a plane is fitted to
TRIPLES = 60_000  # planes through three places that are looked at
SCORED = 600  # of these, that point up, are scored on SCORED_PLACES places
SCORED_PLACES = 4_000
REFINED = 12  # the best of these are refined on all places
INLIERS = 0.008, 0.016, 0.032  # [m]
FINE, CONTRAST = (
    0.01,
    1.5,
)  # [m] with a wider tolerance, a floor has so many times the places of the layer above: no fog
LEAST_SHARE = 0.05  # of the places must lie on the floor
LEAST_SPREAD = 0.06  # [m] standard deviation of the floor's places across its narrow direction: no slice of a wall
BELOW_PRICE = 2.0  # a place below the floor costs as much as two on it gain: a table is no floor, nor is a ceiling


@dataclass(frozen=True)
class Floor:
    """A plane: all p with up . p = offset. What is above it has up . p > offset."""

    up: Float[np.ndarray, "3"]  # unit vector against gravity, in the frame of the cloud
    offset: float  # [m]
    share: float  # of the places that lie on it
    score: float  # the same minus twice the share of places below it
    spread: float  # [m] root mean square distance of these from it


def find_floor(
    points: Float[np.ndarray, "N 3"],
    up: Float[np.ndarray, "3"],
    cone: float,
    *,
    inliers: tuple[float, ...] = INLIERS,
    place: float = 0.03,
    above: Float[np.ndarray, "3"] | None = None,
    seed: int = 0,
) -> Floor | None:
    """The floor of a cloud: the plane of greatest area that little lies below; None when there is none.

    Points are first made into places, one a cube of side `place`, so that area counts and not density. Planes through
    three random places whose upward normal lies within `cone` of `up` are scored by the places on them minus twice
    those below; the best are refined by reweighted least squares (Tukey's biweight), and the best of those wins. It
    must hold 5 % of all places and be no mere strip. Where none does, the cloud may be a noisy one: the next, wider
    tolerance is tried. (The narrowest must be well below half a step: else a slope laid across stairs wins.)

    Args:
      points: [m] finite.
      up: direction against gravity, as far as it is known.
      cone: [rad] by which it may be off, 0 to pi / 2; 0 takes `up` as it is and finds the height alone.
      inliers: [m] from the floor within which a place lies on it, one tried after the other.
      place: [m] side of a place; greater for clouds so wide that there would be too many.
      above: [m] a point that is above the floor for sure, such as the camera.
      seed: of the draws.
    """
    up = np.asarray(up, float) / np.linalg.norm(up)
    rng = np.random.default_rng(seed)
    places = to_places(points, place, rng)
    if len(places) < 3:
        return None
    centre = np.median(places, axis=0)
    places = places - centre
    fewer = places[rng.permutation(len(places))[:SCORED_PLACES]]
    normals, offsets = draw(places, up, cone, rng)
    if above is not None:
        over = normals @ (above - centre) > offsets
        normals, offsets = normals[over], offsets[over]
    if not len(normals):
        return None
    allowed = np.cos(cone) - 1e-9
    for inlier in inliers:
        best = None
        for k in np.argsort(-score(fewer, normals, offsets, inlier), kind="stable")[:REFINED]:
            normal, offset = refine(places, normals[k], offsets[k], inlier, fixed=bool(cone == 0))
            value = score(places, normal[None], np.array([offset]), inlier)[0]
            if normal @ up < allowed or (above is not None and normal @ (above - centre) <= offset):
                continue
            if best is None or value > best[0]:
                best = value, normal, offset
        floor = None if best is None else check_floor(places, *best, inlier)
        if floor is not None:
            return replace(floor, offset=float(floor.offset + floor.up @ centre))
    return None


def check_floor(
    places: Float[np.ndarray, "M 3"], value: float, up: Float[np.ndarray, "3"], offset: float, inlier: float
) -> Floor | None:
    """A plane of a given score as a floor, or None when it is too little or too narrow."""
    distance = places @ up - offset
    on = np.abs(distance) < inlier
    if value < LEAST_SHARE * len(places) or narrow_spread(places[on]) < LEAST_SPREAD:
        return None
    above = (distance > 2 * inlier) & (distance < 4 * inlier)  # as thick a layer
    if inlier > FINE and on.sum() < CONTRAST * above.sum():
        return None
    spread = float(np.sqrt(np.mean(distance[on] ** 2)))
    return Floor(up, float(offset), float(on.mean()), float(value / len(places)), spread)


def to_places(points: Float[np.ndarray, "N 3"], side: float, rng: np.random.Generator) -> Float[np.ndarray, "M 3"]:
    """The mean point of each cube of `side` [m] that holds any, at most MOST_PLACES of them, in float64."""
    if len(points) > 60 * MOST_PLACES:  # enough for any cube that counts
        points = points[rng.integers(0, len(points), 60 * MOST_PLACES)]
    points = np.asarray(points, float)
    if not len(points):
        return points
    index = np.floor((points - points.min(0)) / side).astype(np.int64)
    span = index.max(0) + 1
    key = (index[:, 0] * span[1] + index[:, 1]) * span[2] + index[:, 2]
    _, cube, count = np.unique(key, return_inverse=True, return_counts=True)
    means = np.stack([np.bincount(cube, points[:, k]) for k in range(3)], axis=1) / count[:, None]
    return means[rng.permutation(len(means))[:MOST_PLACES]]


def draw(places, up, cone: float, rng: np.random.Generator):
    """Planes (unit normals [K, 3], offsets [K]) through random places, with normals within `cone` [rad] of `up`."""
    if cone == 0:
        chosen = places[rng.permutation(len(places))[:SCORED]]
        return np.tile(up, (len(chosen), 1)), chosen @ up
    a, b, c = (places[rng.integers(0, len(places), TRIPLES)] for _ in range(3))
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1)
    normals = normals / np.where(length > 0, length, 1)[:, None]
    normals *= np.where(normals @ up < 0, -1.0, 1.0)[:, None]
    good = np.flatnonzero((length > 0) & (normals @ up >= np.cos(cone)))[:SCORED]
    return normals[good], np.einsum("ki,ki->k", normals[good], a[good])


def score(places, normals, offsets, inlier: float):
    """Places on each plane minus twice those below it [K]."""
    distance = normals @ places.T - offsets[:, None]
    return (np.abs(distance) < inlier).sum(1) - BELOW_PRICE * (distance < -2 * inlier).sum(1)


def refine(places, normal, offset: float, inlier: float, fixed: bool):
    """The plane (unit normal, offset) fitted to the places near it; with `fixed`, its offset alone."""
    for width in (4.0, 3.0, 2.0, 2.0, 2.0, 2.0):
        distance = places @ normal - offset
        weight = np.maximum(1 - (distance / (width * inlier)) ** 2, 0) ** 2
        total = weight.sum()
        if total <= 0:
            break
        mean = weight @ places / total
        if not fixed:
            away = places - mean
            _, axes = np.linalg.eigh((away * weight[:, None]).T @ away)
            normal = axes[:, 0] * np.sign(axes[:, 0] @ normal or 1.0)
        offset = float(normal @ mean)
    return normal, offset


def narrow_spread(places) -> float:
    """[m] standard deviation of places of a plane across its narrow direction."""
    if len(places) < 3:
        return 0.0
    return float(np.sqrt(max(np.linalg.eigvalsh(np.cov(places.T))[1], 0)))
