"""Landmark identification: matching found shapes to landmarks at known positions (paper, 2)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Float32

from jaxbiped.arenas.arena import CIRCLE, DISC_RADIUS, SQUARE_SIDE, Landmarks
from jaxbiped.geometry.pose import Pose
from jaxbiped.sensing.camera import Mount
from jaxbiped.sensing.landmarks import LandmarkNoise
from jaxbiped.sensing.view import Sightings
from jaxbiped.stereo.calibration import StereoCamera
from jaxbiped.stereo.landmarks import Blob, Mark, level_rays

GATE, GATE_PER_METRE = 0.10, 0.10  # [m] from the expected position: constant, and per metre due to the heading
BORDER = 0.03  # [m] around a known landmark within which its colour is attributed to it


def recognise(marks: Sequence[Mark], landmarks: Landmarks, believed: Pose, spread: LandmarkNoise) -> Sightings:
    """Assign each mark to the nearest expected landmark of its kind; all on the host, without a batch axis.

    Marks that are near no landmark, or near two, and landmarks that are near two marks, are rejected.

    Args:
      believed: the believed pose.
      spread: the smallest standard deviation of sightings.
    """
    slots = np.shape(landmarks.x)
    x, y, sd = (np.zeros(slots, np.float32) for _ in range(3))
    taken = np.zeros(slots, int)
    ahead, left = in_robot(believed, landmarks)
    for mark in marks:
        away = np.hypot(ahead - mark.x, left - mark.y)
        distance = float(np.hypot(mark.x, mark.y))
        gate = GATE + GATE_PER_METRE * distance
        near = np.flatnonzero(landmarks.used & (landmarks.kind == mark.kind) & (away < gate))
        taken[near] += 1
        if len(near) == 1:
            n = near[0]
            own = np.sqrt((mark.cov[0, 0] + mark.cov[1, 1]) / 2)
            x[n], y[n] = mark.x, mark.y
            sd[n] = max(float(spread.sd + spread.sd_per_metre * distance), own)
    seen = (taken == 1) & (sd > 0)
    return Sightings(*(np.where(seen, values, np.float32(0)) for values in (x, y, sd)), seen)


def in_robot(pose: Pose, landmarks: Landmarks) -> tuple[Float[np.ndarray, "L"], Float[np.ndarray, "L"]]:
    """Positions (forward, left) [m] of landmarks relative to a robot."""
    cos, sin = np.cos(pose.yaw), np.sin(pose.yaw)
    dx, dy = landmarks.x - pose.x, landmarks.y - pose.y
    return cos * dx + sin * dy, cos * dy - sin * dx


def floor_disparity(
    patches: Sequence[tuple[int, Blob]],
    landmarks: Landmarks,
    believed: Pose,
    camera: StereoCamera,
    at: Mount,
    below: float,
) -> Float32[np.ndarray, "H W"]:
    """Disparity [px] of the floor, where the left image shows a known landmark on it; 0 elsewhere.

    Landmarks are plain: a matcher would see holes in the floor. A pixel belongs to a landmark if it has its colour, and
    the floor there is within `BORDER` of it according to the believed pose.

    Args:
      below: [m] depth of the floor below the camera.
    """
    width, height = camera.size
    disparity = np.zeros((height, width), np.float32)
    ahead, left = in_robot(believed, landmarks)
    for kind, blob in patches:
        rows, columns = np.nonzero(blob.mask)
        u, v = columns + blob.corner[0], rows + blob.corner[1]
        ray = level_rays(np.stack([u, v], axis=1).astype(float), camera, at)
        meets = ray[:, 2] < -1e-3
        depth = below / np.where(meets, -ray[:, 2], 1.0)
        place = ray[:, :2] * depth[:, None] + [float(at.forward), 0.0]
        mine = np.flatnonzero(landmarks.used & (landmarks.kind == kind))
        away = np.hypot(place[:, :1] - ahead[mine], place[:, 1:] - left[mine]).min(axis=1, initial=np.inf)
        radius = DISC_RADIUS if kind == CIRCLE else SQUARE_SIDE * np.sqrt(0.5)
        known = meets & (away < radius + BORDER)
        disparity[v[known], u[known]] = camera.focal * camera.baseline / depth[known] - camera.doffs
    return disparity
