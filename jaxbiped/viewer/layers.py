"""A robot's knowledge at a moment of its mission, as arrays for drawing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8

from jaxbiped.mapping.grid import Cell
from jaxbiped.mission.log import MissionLog
from jaxbiped.report.pictures import class_image
from jaxbiped.viewer.triangles import height_colours

TILE, VOXEL = 0.93, 0.88  # drawn fraction of a cell and of a voxel
TILE_HEIGHT, IN_FLOOR = 0.0015, -0.006  # [m] height of the tiles' middles above their ground; of hidden ones
LINE_HEIGHT = 0.012  # [m] height of plan and track above their ground
MOST_POINTS, MOST_OF_ALL = 8000, 60000  # most points shown of one measurement; of all


@dataclass(frozen=True)
class Bricks:
    """Boxes of one size."""

    size: tuple[float, float, float]  # [m]
    centre: Float[np.ndarray, "n 3"]  # [m]
    colour: UInt8[np.ndarray, "n 3"]


@dataclass(frozen=True)
class Cloud:
    """Points."""

    xyz: Float[np.ndarray, "n 3"]  # [m]
    colour: UInt8[np.ndarray, "n 3"]


def moment_at(log: MissionLog, time: float) -> int:
    """The moment of a time [s]: the last that is not after it."""
    return int(np.clip(np.searchsorted(log.time, time + 1e-6, side="right") - 1, 0, len(log.time) - 1))


def tiles(log: MissionLog, t: int) -> Bricks:
    """The classed grid, one tile per cell, each at the level of its ground; tiles of unmeasured cells are in the
    floor."""
    rows, columns = np.indices(log.classes[t].shape).reshape(2, -1)
    z = np.maximum(log.levels[t].ravel().astype(float), 0) * log.level_height + TILE_HEIGHT
    z[log.classes[t].ravel() == Cell.UNMEASURED] = IN_FLOOR
    side = TILE * log.pitch
    colours = class_image(log.classes[t], log.levels[t]).reshape(-1, 3)
    return Bricks((side, side, 0.002), np.column_stack([centres(log, rows, columns), z]), colours)


def voxels(log: MissionLog, t: int) -> Bricks:
    """The occupied voxels of the 3D grid above the base floor, coloured by height; none if the log has none."""
    size = (VOXEL * log.pitch, VOXEL * log.pitch, VOXEL * log.level_height)
    if log.voxels is None:
        return Bricks(size, np.zeros((0, 3)), np.zeros((0, 3), np.uint8))
    rows, columns, levels = np.nonzero(log.voxels[t, ..., 1:])
    levels = levels + 1  # those of level 0 would cover the class map
    z = levels * log.level_height
    return Bricks(size, np.column_stack([centres(log, rows, columns), z]), height_colours(z))


def cloud(log: MissionLog, t: int, earlier: bool = False) -> Cloud:
    """The points of the last measurement, or of all so far, coloured by height; evenly thinned if there are too
    many."""
    if not log.points:
        return Cloud(np.zeros((0, 3)), np.zeros((0, 3), np.uint8))
    last = max(0, len(log.points) - 2)  # nothing was measured after the last action: it repeats the one before
    xyz = np.concatenate(log.points[: min(t, last) + 1]) if earlier else log.points[t]
    xyz = xyz[:: max(1, -(-len(xyz) // (MOST_OF_ALL if earlier else MOST_POINTS)))]
    return Cloud(xyz.astype(float), height_colours(xyz[:, 2]))


def plan_line(log: MissionLog, t: int) -> Float[np.ndarray, "n 2 3"]:
    """The plan as arrows from point to point, above the ground according to the robot."""
    return segments(on_ground(log, t, np.asarray(log.plan[t], float).reshape(-1, 2)))


def track_line(log: MissionLog, t: int) -> Float[np.ndarray, "n 2 3"]:
    """The track so far, from moment to moment."""
    z = np.zeros(t + 1) if log.true_z is None else log.true_z[: t + 1]
    return segments(np.column_stack([log.true_xyyaw[: t + 1, :2], z + LINE_HEIGHT]))


def belief(log: MissionLog, t: int) -> tuple[float, float, float, float]:
    """The believed pose: (x, y, z) [m] and yaw [rad]."""
    x, y, yaw = (float(value) for value in log.estimated_xyyaw[t])
    return x, y, 0.0 if log.true_z is None else float(log.true_z[t]), yaw


def on_ground(log: MissionLog, t: int, xy: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 3"]:
    """Points [m] slightly above the map's ground."""
    columns, rows = np.floor((xy - log.origin_xy) / log.pitch).astype(int).T
    height, width = log.levels[t].shape
    level = log.levels[t][np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)]
    return np.column_stack([xy, np.maximum(level.astype(float), 0) * log.level_height + LINE_HEIGHT])


def segments(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "m 2 3"]:
    """Segments from each point to the next; repeated points give none."""
    pairs = np.stack([points[:-1], points[1:]], axis=1) if len(points) > 1 else np.zeros((0, 2, 3))
    return pairs[np.linalg.norm(pairs[:, 1] - pairs[:, 0], axis=1) > 1e-6]


def centres(log: MissionLog, rows: np.ndarray, columns: np.ndarray) -> Float[np.ndarray, "n 2"]:
    """Centres of cells [m]."""
    return np.column_stack([columns + 0.5, rows + 0.5]) * log.pitch + log.origin_xy
