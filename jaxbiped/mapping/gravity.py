"""Clouds set upright: z against gravity, the floor at height 0."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from jaxbiped.mapping.floor import INLIERS, Floor, find_floor

# Rotations of clouds whose frame has another axis up, to x forward, y left, z up; rows are the new axes.
FRAMES = {
    "z": np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1]]),  # robots and maps
    "-y": np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]]),  # cameras: x right, y down, z ahead
    "y": np.array([[0, 0, -1], [-1, 0, 0], [0, 1, 0]]),  # graphics: x right, y up, z to the viewer
    "-z": np.array([[1, 0, 0], [0, -1, 0], [0, 0, -1]]),
    "x": np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]]),
    "-x": np.array([[0, -1, 0], [0, 0, 1], [-1, 0, 0]]),
}
LIKELY = {"z": 1.0, "-y": 0.5, "y": 0.5}  # frames that are tried where nothing is known, and what a floor counts there
CONE = math.radians(30.0)  # that up may be off an axis of the frame, where nothing is known
RIVAL_CONE = math.radians(60.0)  # off the floor, within which another plane may be the true one; steeper, it is a wall
SAMPLE = 100_000  # points that are counted on two planes


@dataclass(frozen=True)
class Upright:
    """The rigid motion that sets a cloud upright: p_map = R p + shift."""

    R: Float[np.ndarray, "3 3"]
    shift: Float[np.ndarray, "3"]  # [m]
    floor: Floor | None  # as it was found, in the frame of the cloud; None where it was given
    frame: str  # the axis of the cloud's frame that points up, or nearly
    height: float  # [m] of the floor along that axis, at the pivot
    rival: Floor | None = None  # a plane that holds more points, but is too steep to have been looked for

    def apply(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """Points [m] in the frame of the map, of the same type."""
        kind = points.dtype
        return points @ self.R.T.astype(kind) + self.shift.astype(kind)

    @property
    def tilt(self) -> float:
        """[rad] between up and the axis of the cloud's frame that is nearest to it."""
        return float(np.arccos(np.clip((self.R @ FRAMES[self.frame].T)[2, 2], -1, 1)))


def nearest_frame(up: Float[np.ndarray, "3"]) -> str:
    """Which axis of a cloud's frame is nearest to `up`."""
    return max(FRAMES, key=lambda name: float(FRAMES[name][2] @ up))


def set_upright(
    up: Float[np.ndarray, "3"], offset: float, pivot: Float[np.ndarray, "3"], floor: Floor | None = None
) -> Upright:
    """The motion that takes the plane up . p = offset [m] to z = 0, and changes x and y as little as it can.

    Axes are renamed as the frame wants it (`FRAMES`); then the cloud is turned about `pivot` [m], by the shortest way.
    A cloud whose z is up keeps its x and y there: those of a map stay those of the map.
    """
    frame = nearest_frame(up)
    renamed = FRAMES[frame].astype(float)
    turned = shortest(renamed @ up)
    R = turned @ renamed
    shift = renamed @ pivot - R @ pivot
    shift[2] = -offset
    x, y, z = renamed @ up
    height = (offset - np.array([x, y]) @ (renamed @ pivot)[:2]) / z
    return Upright(R, shift, floor, frame, float(height))


def shortest(up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """The smallest rotation that takes the unit vector `up` to z; it must not point down."""
    x, y, z = up
    k = 1 / (1 + z)
    return np.array([[1 - k * x * x, -k * x * y, -x], [-k * x * y, 1 - k * y * y, -y], [x, y, z]])


def find_upright(
    points: Float[np.ndarray, "N 3"], up: Float[np.ndarray, "3"] | None = None, tilt: float = math.radians(10.0), **how
) -> Upright | None:
    """Gravity and the floor of a cloud, as `find_floor` finds them; None when it finds none.

    Args:
      points: [m] finite.
      up: direction against gravity, off by up to `tilt` [rad]; 0 takes it as it is. None: z, -y (a camera's frame) or
        y (of graphics) is up within 30 degrees, whichever shows the greatest floor; z counts twice.
      how: further arguments of `find_floor`.

    Where nothing was known, a plane that is more than 30 degrees off all of these axes, holds more points than the
    floor and has as little below it is returned as the `rival`: then up must be said.
    """
    if not len(points):
        return None
    if up is None:
        found = {name: find_floor(points, FRAMES[name][2].astype(float), CONE, **how) for name in LIKELY}
        known = {name: floor for name, floor in found.items() if floor is not None}
        floor = max(known.items(), key=lambda item: LIKELY[item[0]] * item[1].score, default=(None, None))[1]
    else:
        floor = find_floor(points, up, tilt, **how)
    if floor is None:
        return None
    pivot = np.median(points[:: max(1, len(points) // 10_000)], axis=0).astype(float)
    upright = set_upright(floor.up, floor.offset, pivot, floor)
    return upright if up is not None else replace(upright, rival=find_rival(points, floor, **how))


def find_rival(points: Float[np.ndarray, "N 3"], floor: Floor, **how) -> Floor | None:
    """A plane steeper than `find_upright` looks at that holds more points than `floor`, or None."""
    rival = find_floor(points, floor.up, RIVAL_CONE, **how)
    if rival is None or max(float(FRAMES[name][2] @ rival.up) for name in LIKELY) >= math.cos(CONE):
        return None
    some = np.asarray(points[:: max(1, len(points) // SAMPLE)], float)
    near = max(INLIERS[0], 2 * rival.spread)
    held, more = (int((np.abs(some @ plane.up - plane.offset) < near).sum()) for plane in (floor, rival))
    return rival if more > held else None
