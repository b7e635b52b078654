"""Landmarks in a pair of pictures: red discs and blue squares on the floor, found and measured to a millimetre.

All is computed on the floor. A pixel's ray meets a level plane at depth D below the camera at D times a direction that
depends on the pixel alone, so that a contour on the floor is linear in D. Middle and D are fitted jointly to the left
and right contours of a shape: its known size and the distance of the two cameras both determine them, and centres of
ellipses, which perspective moves by millimetres, are not needed. As a robot tilts about its feet, the middle is correct
for any attitude, to second order. (Paper, 2.1 and 3.1, which name the shapes, not how they are measured.)
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float64, UInt8

from jaxbiped.arenas.arena import CIRCLE, DISC_RADIUS, SQUARE, SQUARE_SIDE
from jaxbiped.sensing.camera import Mount
from jaxbiped.stereo.calibration import StereoCamera

CHANNELS = {CIRCLE: (0, 1, 2), SQUARE: (2, 0, 1)}  # RGB channels: the colour of a kind, and the two others
VIVID = 60  # grey levels by which its colour exceeds the others
LEAST_PIXELS = 24  # fewest pixels of a shape
PROFILE = np.arange(-2.5, 2.51, 0.25)  # [px] across a contour, inwards to outwards, along which its edge is searched
HEIGHT_SD, TILT_SD = 0.015, 0.01  # [m, rad] of the floor's depth below the camera, and of the robot's attitude
CORNER = 0.7  # share of half a side, from the middle, in which points are used for that side
ROUNDS, NUDGE, CONVERGED = 8, 1e-5, 1e-5  # Gauss-Newton rounds; steps [m, rad]
BLUR = 0.12  # [px] standard deviation of a contour point
WORST_MEAN, WORST = 0.35, 1.6  # [px] root mean square, and greatest distance, of a whole shape's contour from its fit
WORST_SD = 0.004  # [m] largest standard deviation of a middle
FEWEST = 10  # fewest points of a contour, in each image
SAME_ROW = 2.5  # [px] largest row difference of a shape's middles in both images
FURTHEST_MATCH = 0.3  # largest relative deviation of a disparity from that of the floor


@dataclass(frozen=True)
class Mark:
    """A landmark as measured, in the robot frame."""

    kind: int  # CIRCLE or SQUARE
    x: float  # [m] forward
    y: float  # [m] left
    yaw: float  # [rad] of a square, modulo 90 degrees, in [-pi/4, pi/4); 0 of a disc
    cov: Float64[np.ndarray, "2 2"]  # [m^2] of x and y, from the contour's own noise
    below: float  # [m] depth of the floor below the camera


@dataclass(frozen=True)
class Blob:
    """A patch of one colour in one image."""

    mask: Bool[np.ndarray, "h w"]
    corner: tuple[int, int]  # [px] (u, v) of the mask's first pixel
    middle: Float64[np.ndarray, "2"]  # [px] (u, v)
    whole: bool  # whether it does not touch the image's border
    contour: Float64[np.ndarray, "N 2"]  # [px] of its edge
    normal: Float64[np.ndarray, "N 2"]  # outwards


def find(
    left: UInt8[np.ndarray, "H W 3"],
    right: UInt8[np.ndarray, "H W 3"],
    camera: StereoCamera,
    at: Mount,
    floor: float,
) -> tuple[tuple[Mark, ...], tuple[tuple[int, Blob], ...]]:
    """Find the landmarks of a pair.

    A shape counts if it is completely visible in both images and its contours fit: shapes that are half hidden, of
    another size or form, or not on the floor, do not.

    Args:
      at: believed pose of the camera on the robot.
      floor: [m] height of the floor over the robot's supporting surface; negative if it stands on a bump.

    Returns:
      The measured landmarks; and all patches of the landmarks' colours in the left image, with their kinds.
    """
    below = float(at.height) - floor
    marks, patches = [], []
    for kind in CHANNELS:
        ours, theirs = blobs(left, kind), blobs(right, kind)
        patches += [(kind, blob) for blob in ours]
        for blob in ours:
            other = partner(blob, theirs, camera, at, below)
            if other is not None:
                mark = measure(kind, blob, other, camera, at, below)
                if mark is not None:
                    marks.append(mark)
    return tuple(marks), tuple(patches)


def vividness(image: UInt8[np.ndarray, "H W 3"], kind: int) -> UInt8[np.ndarray, "H W"]:
    """By how much a kind's colour exceeds the two others in each pixel; 0 where it does not."""
    own, other, third = (np.ascontiguousarray(image[..., k]) for k in CHANNELS[kind])
    return cv2.subtract(own, cv2.max(other, third))


def blobs(image: UInt8[np.ndarray, "H W 3"], kind: int) -> list[Blob]:
    """Patches of a kind's colour, with their edges to a fraction of a pixel."""
    vivid = vividness(image, kind)
    count, labels, stats, middles = cv2.connectedComponentsWithStats((vivid > VIVID).astype(np.uint8))
    height, width = vivid.shape
    found = []
    for n in range(1, count):
        u, v, w, h, area = (int(value) for value in stats[n])
        if area < LEAST_PIXELS:
            continue
        mask = labels[v : v + h, u : u + w] == n
        whole = u > 2 and v > 2 and u + w < width - 3 and v + h < height - 3
        edge, normal = contour(vivid, mask, (u, v)) if whole else (np.zeros((0, 2)),) * 2
        found.append(Blob(mask, (u, v), middles[n].astype(float), whole, edge, normal))
    return found


def contour(
    vivid: UInt8[np.ndarray, "H W"], mask: Bool[np.ndarray, "h w"], corner: tuple[int, int]
) -> tuple[Float64[np.ndarray, "N 2"], Float64[np.ndarray, "N 2"]]:
    """Where a patch's vividness falls to half its inner value: points [px] and outward directions."""
    u, v = corner
    margin = 5
    top, first = max(v - margin, 0), max(u - margin, 0)
    near = vivid[top : v + mask.shape[0] + margin, first : u + mask.shape[1] + margin].astype(np.float32)
    rings, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    ring = max(rings, key=len).reshape(-1, 2).astype(np.float32) + np.float32([u - first, v - top])
    smooth = cv2.GaussianBlur(near, (0, 0), 1.0)
    slope = [sample(cv2.Sobel(smooth, cv2.CV_32F, *order), ring) for order in ((1, 0), (0, 1))]
    outward = -np.stack(slope, axis=-1)
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-6)
    places = ring[:, None] + PROFILE[None, :, None].astype(np.float32) * outward[:, None]
    values = sample(near, places.reshape(-1, 2)).reshape(len(ring), -1)
    inside = np.median(near[v - top : v - top + mask.shape[0], u - first : u - first + mask.shape[1]][mask])
    over = values >= inside / 2
    falls = over[:, :-1] & ~over[:, 1:]
    k = np.argmax(falls, axis=1)
    row = np.arange(len(ring))
    before, after = values[row, k], values[row, k + 1]
    share = (before - inside / 2) / np.maximum(before - after, 1e-3)
    offset = PROFILE[k] + share * (PROFILE[1] - PROFILE[0])
    clear = falls.sum(axis=1) == 1
    points = ring + offset[:, None] * outward + [first, top]
    return points[clear].astype(float), outward[clear].astype(float)


def sample(image: Float[np.ndarray, "H W"], points: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N"]:
    """Interpolated values between pixels."""
    u, v = (np.ascontiguousarray(points[None, :, k], np.float32) for k in (0, 1))
    return cv2.remap(image, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)[0]


def level_rays(points: Float64[np.ndarray, "N 2"], camera: StereoCamera, at: Mount) -> Float64[np.ndarray, "N 3"]:
    """Directions (forward, left, up) of the rays of pixels [px], one unit deep, for the believed camera pose."""
    x = (points[:, 0] - camera.centre[0]) / camera.focal
    y = (points[:, 1] - camera.centre[1]) / camera.focal
    cos, sin = np.cos(float(at.pitch)), np.sin(float(at.pitch))
    return np.stack([cos - sin * y, -x, -(sin + cos * y)], axis=1)


def partner(blob: Blob, others: list[Blob], camera: StereoCamera, at: Mount, below: float) -> Blob | None:
    """The patch of the right image that shows the same shape, on the floor."""
    cos, sin = np.cos(float(at.pitch)), np.sin(float(at.pitch))
    down = sin + cos * (blob.middle[1] - camera.centre[1]) / camera.focal
    if not blob.whole or down <= 1e-3:
        return None
    expected = camera.focal * camera.baseline * down / below - camera.doffs
    best, least = None, FURTHEST_MATCH * expected + 2
    for other in others:
        off = abs(blob.middle[0] - other.middle[0] - expected)
        if other.whole and abs(other.middle[1] - blob.middle[1]) <= SAME_ROW and off < least:
            best, least = other, off
    return best


def measure(kind: int, left: Blob, right: Blob, camera: StereoCamera, at: Mount, below: float) -> Mark | None:
    """The landmark that both patches show; None if they do not fit one.

    Gauss-Newton over six numbers: the middle's (forward, left) and the depth of its plane below the camera [m], the
    robot's tilt forward and to the right [rad], and the yaw of a square [rad]. Depth and tilt have priors; without the
    tilt, the known size would pull the middle to a wrong distance. Residuals are in pixels, across the contours.
    """
    if min(len(left.contour), len(right.contour)) < FEWEST:
        return None
    points, normals = (np.concatenate(pair) for pair in ((left.contour, right.contour), (left.normal, right.normal)))
    rays = level_rays(points, camera, at), level_rays(points + normals, camera, at)
    eye = np.zeros((len(points), 3))
    eye[len(left.contour) :, 1] = -camera.baseline
    rough = rays[0][:, :2] * (below / np.maximum(-rays[0][:, 2:], 1e-3))
    state = np.array([*rough[: len(left.contour)].mean(axis=0), below, 0.0, 0.0, 0.0])
    if kind == SQUARE:
        state[5] = quarter(np.deg2rad(cv2.minAreaRect(rough[: len(left.contour)].astype(np.float32))[2]))
    free = 6 if kind == SQUARE else 5
    prior = np.array([np.inf, np.inf, HEIGHT_SD, TILT_SD, TILT_SD, np.inf])[:free]
    mean = np.array([0, 0, below, 0, 0, 0])[:free]
    for _ in range(ROUNDS):
        off, counts = residuals(kind, state, rays, eye)
        if counts.sum() < 2 * FEWEST:
            return None
        J = np.column_stack(
            [(residuals(kind, state + step, rays, eye)[0] - off) / NUDGE for step in NUDGE * np.eye(6)[:free]]
        )
        A = np.vstack([J[counts] / BLUR, np.diag(1 / prior)])
        b = np.concatenate([off[counts] / BLUR, (state[:free] - mean) / prior])
        change = np.linalg.lstsq(A, -b, rcond=None)[0]
        state[:free] += change
        if not np.all(np.isfinite(state)):
            return None
        if np.max(np.abs(change)) < CONVERGED:
            break
    off, counts = residuals(kind, state, rays, eye)
    cov = np.linalg.inv(A.T @ A)
    fits = np.sqrt(np.mean(off[counts] ** 2)) <= WORST_MEAN and np.max(np.abs(off[counts])) <= WORST
    certain = np.sqrt(cov[0, 0] + cov[1, 1]) <= WORST_SD
    likely = np.all(np.abs(state[:free] - mean) < 3 * prior)
    if not (fits and certain and likely) or (kind == SQUARE and not four_sides(state, rays[0], eye, counts)):
        return None
    forward, side, _ = tilting(state).T @ np.array([state[0], state[1], -state[2]])
    yaw = float(quarter(state[5]))
    return Mark(kind, float(at.forward) + float(forward), float(side), yaw, cov[:2, :2], float(state[2]))


def residuals(
    kind: int,
    state: Float64[np.ndarray, "6"],
    rays: tuple[Float64[np.ndarray, "N 3"], Float64[np.ndarray, "N 3"]],
    eye: Float64[np.ndarray, "N 3"],
) -> tuple[Float64[np.ndarray, "N"], Bool[np.ndarray, "N"]]:
    """Distances [px] of contour points from the shape of a state, outwards, and which of them count.

    Args:
      rays: rays of the points, and of points one pixel outwards.
      eye: [m] origin of each ray, relative to the left camera.
    """
    (off, counts), (further, _) = (distances(kind, state, places(state, ray, eye)) for ray in rays)
    return off / np.maximum(further - off, 1e-6), counts


def tilting(state: Float64[np.ndarray, "6"]) -> Float64[np.ndarray, "3 3"]:
    """Rotation of the believed (forward, left, up) to those of a robot tilted according to the state; both are
    small."""
    pitch, roll = state[3:5]
    return np.array([[1, 0, pitch], [0, 1, roll], [-pitch, -roll, 1]])


def places(
    state: Float64[np.ndarray, "6"], ray: Float64[np.ndarray, "N 3"], eye: Float64[np.ndarray, "N 3"]
) -> Float64[np.ndarray, "N 2"]:
    """Where rays meet the plane of a state, relative to its middle [m]."""
    R = tilting(state)
    ray, eye = ray @ R.T, eye @ R.T
    reach = (-state[2] - eye[:, 2:]) / np.minimum(ray[:, 2:], -1e-3)
    return (eye + reach * ray)[:, :2] - state[:2]


def distances(
    kind: int, state: Float64[np.ndarray, "6"], place: Float64[np.ndarray, "N 2"]
) -> tuple[Float64[np.ndarray, "N"], Bool[np.ndarray, "N"]]:
    """Distance [m] of points from the edge of a disc or a square around the origin, outwards; which of them count.

    Near the corners of a square, which pixels round off, none does.
    """
    if kind == CIRCLE:
        return np.linalg.norm(place, axis=1) - DISC_RADIUS, np.ones(len(place), bool)
    own = np.abs(in_square(state, place))
    return own.max(axis=1) - SQUARE_SIDE / 2, own.min(axis=1) <= CORNER * SQUARE_SIDE / 2


def in_square(state: Float64[np.ndarray, "6"], place: Float64[np.ndarray, "N 2"]) -> Float64[np.ndarray, "N 2"]:
    """Points along a square's own axes."""
    cos, sin = np.cos(state[5]), np.sin(state[5])
    return place @ np.array([[cos, -sin], [sin, cos]])


def four_sides(
    state: Float64[np.ndarray, "6"],
    ray: Float64[np.ndarray, "N 3"],
    eye: Float64[np.ndarray, "N 3"],
    counts: Bool[np.ndarray, "N"],
) -> bool:
    """Whether points lie on each side of a square."""
    own = in_square(state, places(state, ray, eye))
    side = np.round(np.arctan2(own[:, 1], own[:, 0]) / (np.pi / 2)).astype(int) % 4
    return len(set(side[counts].tolist())) == 4


def quarter(angle: float | np.floating) -> float | np.floating:
    """An angle [rad] modulo 90 degrees, in [-pi/4, pi/4)."""
    return (angle + np.pi / 4) % (np.pi / 2) - np.pi / 4
