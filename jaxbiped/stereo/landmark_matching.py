"""Which landmark is which: what was found in the pictures, against what is known to lie where (paper, 2)."""

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

GATE, GATE_PER_METRE = 0.10, 0.10  # [m] from where a landmark is expected: of the place, and by the heading
BORDER = 0.03  # [m] around a known landmark in which its colour is its own


def recognise(marks: Sequence[Mark], landmarks: Landmarks, believed: Pose, spread: LandmarkNoise) -> Sightings:
    """Each mark as the landmark of its kind that is expected nearest to it; all on the host, without a batch axis.

    Marks that are near no landmark, or near two, and landmarks that two marks are near to, are refused.

    Args:
      believed: where the robot believes to stand.
      spread: the least standard deviation of what is seen.
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
    """Landmarks (forward, left) [m] of a robot."""
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
    """Disparity [px] of the floor, where the left image shows a known landmark lie on it; 0 elsewhere.

    Landmarks are plain: a matcher sees holes in the floor where there are none. A pixel is one of a landmark when it
    has its colour, and the floor there is, as the robot believes to stand, within `BORDER` of it.

    Args:
      below: [m] of the floor below the camera.
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
