"""Visual odometry: the robot's motion between two measurements, from their pictures.

Scale-invariant features (Lowe, 2004) of the left pictures, each with the disparity found by the matcher, are matched by
their descriptors, since a robot that turns by 45 degrees between two pictures defeats pixel tracking. Three matches
determine a rigid motion; the one supported by most matches is refined on all of these by least squares in columns, rows
and disparities, where the errors are uniform. The motion has all six degrees of freedom: otherwise a body that sways by
half a degree would be mistaken for one that walked.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, Int, UInt8

from jaxbiped.sensing.camera import Mount
from jaxbiped.sensing.shot import Shot
from jaxbiped.sensing.view import Motion
from jaxbiped.stereo.calibration import StereoCamera
from jaxbiped.stereo.matching import grey

MOST = 800  # most features of a picture
RATIO = 0.8  # ratio of the distances of the best and the second best match (Lowe, 2004, 7.1)
HYPOTHESES = 200  # number of motions tried
SPREAD = np.array([0.6, 0.6, 0.3])  # [px] standard deviations of a match in column, row and disparity
FAR = 16.3  # squared distance in these units beyond which a match is wrong: true for one good match in 1,000
TILT, CLIMB = np.deg2rad(6.0), 0.06  # [rad, m] limits of a robot's tilt and vertical motion from view to view
ASTRAY, TURNED = 0.05, 0.15  # [m, rad] largest error of dead reckoning
LEAST = 12  # fewest matches that must agree on a motion
ROUNDS = 8  # rounds of least squares
KEPT = 256  # views kept: more than the robots that walk at once
# Of the covariance: errors of neighbours are correlated (`sweeps/studies/visual_odometry.py`).
INFLATION = 2.0


@dataclass(frozen=True)
class Features:
    """What can be recognised again from one measurement."""

    seen: Float[np.ndarray, "n 3"]  # [px] column, row, disparity
    points: Float[np.ndarray, "n 3"]  # [m] in the robot frame, for a robot that stands upright
    descriptors: Float32[np.ndarray, "n 128"]
    R: Float[np.ndarray, "3 3"]  # from the camera frame to the robot frame
    origin: Float[np.ndarray, "3"]  # [m] of the camera, robot frame


def find_features(
    picture: UInt8[np.ndarray, "H W"], disparity: Float32[np.ndarray, "H W"], camera: StereoCamera, at: Mount
) -> Features:
    """The features of a grey left picture that have a disparity [px] (0: none); none of a plain one."""
    pitch = float(at.pitch)
    cos, sin = np.cos(pitch), np.sin(pitch)
    R = np.array([[0, -sin, cos], [-1, 0, 0], [0, -cos, -sin]])
    origin = np.array([float(at.forward), 0.0, float(at.height)])
    measured = (disparity != 0) & (disparity + camera.doffs > 0)
    mask = measured.astype(np.uint8)
    # Precise: otherwise all features are shifted by a quarter of a pixel, which is 0.4 mm in each turn.
    found, descriptors = cv2.SIFT_create(nfeatures=MOST, enable_precise_upscale=True).detectAndCompute(picture, mask)
    if not found:
        nothing = np.zeros((0, 3))
        return Features(nothing, nothing, np.zeros((0, 128), np.float32), R, origin)
    place = np.array([feature.pt for feature in found])
    # A position may have several features, one for each gradient direction: one is enough.
    place, first = np.unique(place, axis=0, return_index=True)
    column, row = np.rint(place).astype(int).T
    d, good = disparity[row, column].astype(float), measured[row, column]
    seen = np.column_stack([place, d])[good]
    return Features(seen, to_robot(seen, camera, R, origin), descriptors[first][good], R, origin)


def to_robot(seen, camera: StereoCamera, R, origin) -> Float[np.ndarray, "n 3"]:
    """Points [m] in the robot frame of columns, rows and disparities [px]."""
    depth = camera.focal * camera.baseline / (seen[:, 2] + camera.doffs)
    x, y = ((seen[:, k] - camera.centre[k]) * depth / camera.focal for k in range(2))
    return np.column_stack([x, y, depth]) @ R.T + origin


def find_motion(
    before: Features, after: Features, camera: StereoCamera, expected: Float[np.ndarray, "3"], seed: int = 0
) -> Motion:
    """The robot's motion from one measurement to the next; `seen` is False if too few matches agree on one.

    Args:
      expected: (x, y, yaw) [m, m, rad] by dead reckoning: a floor that looks the same in two places is misleading.
      seed: seed of the motions tried.
    """
    a, b = matches(after.descriptors, before.descriptors)
    points, goal = after.points[a], before.seen[b]
    guess = propose(points, before.points[b], goal, before, camera, expected, np.random.default_rng(seed))
    if guess is None:
        return no_motion()
    R, t = guess
    for _ in range(ROUNDS):
        residual, J = linearise(points, goal, R, t, before, camera)
        squared = np.sum(residual**2, axis=1)
        weight = np.maximum(1 - squared / (2 * FAR), 0) ** 2  # Tukey's biweight
        H = np.einsum("n,nki,nkj->ij", weight, J, J)
        if np.sum(squared < FAR) < LEAST or np.linalg.cond(H) > 1e12:
            return no_motion()
        step = -np.linalg.solve(H, np.einsum("n,nki,nk->i", weight, J, residual))
        R, t = cv2.Rodrigues(step[3:])[0] @ R, t + step[:3]
    good = squared < FAR
    spread = max(float(np.mean(squared[good]) / 3), 1.0)
    cov = INFLATION * spread * np.linalg.inv(H)
    kept = [0, 1, 5]
    moved = np.array([t[0], t[1], np.arctan2(R[1, 0], R[0, 0])])
    if not (np.isfinite(moved).all() and np.isfinite(cov).all() and possible(R, t, expected)):
        return no_motion()
    return Motion(*moved.astype(np.float32), cov[np.ix_(kept, kept)].astype(np.float32), np.bool_(True))


class Tracker:
    """Keeps the features of the last views, by name, and returns the motion from one to the next."""

    def __init__(self, camera: StereoCamera):
        self.camera = camera
        self.kept: OrderedDict[bytes, Features] = OrderedDict()

    def __call__(self, shot: Shot, at: Mount, now: bytes, then: bytes, expected: Float[np.ndarray, "3"]) -> Motion:
        """The motion from view `then`, if it is kept, to this one, which is kept as `now`; see `find_motion`."""
        found = find_features(grey(shot.left), shot.disparity, self.camera, at)
        before = self.kept.get(then)
        self.kept[now] = found
        while len(self.kept) > KEPT:
            self.kept.popitem(last=False)
        return no_motion() if before is None else find_motion(before, found, self.camera, expected)


def no_motion() -> Motion:
    """The result if nothing was found."""
    return Motion(*np.zeros(3, np.float32), np.zeros((3, 3), np.float32), np.bool_(False))


def matches(
    one: Float32[np.ndarray, "n 128"], other: Float32[np.ndarray, "m 128"]
) -> tuple[Int[np.ndarray, "k"], Int[np.ndarray, "k"]]:
    """Rows of descriptors that are nearest to each other, and clearly nearer than the next."""
    none = np.zeros(0, int)
    if len(one) < 2 or len(other) < 2:
        return none, none
    near = cv2.BFMatcher(cv2.NORM_L2).knnMatch(one, other, k=2)
    back = np.array([m.trainIdx for m in cv2.BFMatcher(cv2.NORM_L2).match(other, one)])
    pairs = [(m.queryIdx, m.trainIdx) for m, second in near if m.distance < RATIO * second.distance]
    pairs = [(q, t) for q, t in pairs if back[t] == q]
    return tuple(np.array(pairs, int).T) if pairs else (none, none)


def propose(points, goal_points, goal, before: Features, camera: StereoCamera, expected, rng: np.random.Generator):
    """The motion (R, t) through three matches that is supported by most matches; None if by too few."""
    if len(points) < LEAST:
        return None
    three = np.argsort(rng.random((HYPOTHESES, len(points))), axis=1)[:, :3]
    R, t = rigid(points[three], goal_points[three])
    moved = np.einsum("kij,nj->kni", R, points) + t[:, None]
    agree = np.sum(((project(moved, before, camera) - goal) / SPREAD) ** 2, axis=2) < FAR
    agree &= possible(R, t, expected)[:, None]
    best = int(np.argmax(agree.sum(1)))
    if agree[best].sum() < LEAST:
        return None
    R, t = rigid(points[agree[best]][None], goal_points[agree[best]][None])
    return R[0], t[0]


def possible(R: Float[np.ndarray, "*k 3 3"], t: Float[np.ndarray, "*k 3"], expected) -> Bool[np.ndarray, "*k"]:
    """Whether a motion is possible for a robot: little tilt, a climb of at most a step, and about as expected."""
    turned = np.arctan2(R[..., 1, 0], R[..., 0, 0]) - expected[2]
    near = np.hypot(t[..., 0] - expected[0], t[..., 1] - expected[1]) < ASTRAY
    near &= np.abs(np.angle(np.exp(1j * turned))) < TURNED
    return np.asarray(near & (R[..., 2, 2] > np.cos(TILT)) & (np.abs(t[..., 2]) < CLIMB))


def rigid(points: Float[np.ndarray, "k n 3"], goal: Float[np.ndarray, "k n 3"]):
    """Rotations [k, 3, 3] and shifts [k, 3] that take points to `goal` by least squares (Kabsch, 1976)."""
    middle, to = points.mean(1), goal.mean(1)
    U, _, Vt = np.linalg.svd(np.einsum("kni,knj->kij", goal - to[:, None], points - middle[:, None]))
    flip = np.ones((len(points), 3))
    flip[:, 2] = np.sign(np.linalg.det(U @ Vt))
    R = (U * flip[:, None]) @ Vt
    return R, to - np.einsum("kij,kj->ki", R, middle)


def project(points, before: Features, camera: StereoCamera):
    """Columns, rows and disparities [..., 3] [px] of points [..., 3] [m] in the robot frame; far away behind it."""
    x, y, z = np.moveaxis((points - before.origin) @ before.R, -1, 0)
    inverse = np.where(z > 1e-3, 1 / np.where(z > 1e-3, z, 1.0), 1e6)
    return np.stack(
        [
            camera.focal * x * inverse + camera.centre[0],
            camera.focal * y * inverse + camera.centre[1],
            camera.focal * camera.baseline * inverse - camera.doffs,
        ],
        axis=-1,
    )


def linearise(points, goal, R, t, before: Features, camera: StereoCamera):
    """Residuals [n, 3] in standard deviations, and their Jacobians [n, 3, 6] by shift and small rotation."""
    turned = points @ R.T
    moved = turned + t
    residual = (project(moved, before, camera) - goal) / SPREAD
    x, y, z = ((moved - before.origin) @ before.R).T
    z = np.maximum(z, 1e-3)
    f, zero = camera.focal, np.zeros_like(z)
    by_camera = np.stack(
        [
            np.stack([f / z, zero, -f * x / z**2], axis=1),
            np.stack([zero, f / z, -f * y / z**2], axis=1),
            np.stack([zero, zero, -f * camera.baseline / z**2], axis=1),
        ],
        axis=1,
    )
    by_point = by_camera @ before.R.T / SPREAD[:, None]
    p, q, r = turned.T
    cross = np.stack([np.stack([zero, r, -q], 1), np.stack([-r, zero, p], 1), np.stack([q, -p, zero], 1)], axis=1)
    return residual, np.concatenate([by_point, by_point @ cross], axis=2)
