"""Arenas for the tests of this room: a few random boxes and landmarks, and one made by hand."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped.arenas.arena import Arena, Landmarks
from jaxbiped.geometry.boxes import Boxes
from jaxbiped.geometry.pose import Pose
from jaxbiped.sensing import CameraConfig

CONFIG = CameraConfig()
CAMERA, IMAGE = CONFIG.traced(), CONFIG.image
SLOTS, MARKS = 6, 5


def as_numpy(tree):
    return jax.tree.map(np.asarray, tree)


def as_jax(tree):
    return jax.tree.map(jnp.asarray, tree)


def stack(trees):
    return jax.tree.map(lambda *leaves: jnp.asarray(np.stack(leaves)), *trees)


def make(boxes=(), landmarks=(), floor_contrast=1.0, size_xy=(1.8, 1.4)) -> Arena:
    """Boxes: (x, y, yaw, half_x, half_y, bottom, top[, contrast]); landmarks: (x, y[, kind]); unused slots: NaN."""
    rows = np.full((8, SLOTS), np.nan, np.float32)
    for m, box in enumerate(boxes):
        rows[:, m] = (*box, 1.0)[:8]
    used = np.arange(SLOTS) < len(boxes)
    marks = np.full((3, MARKS), np.nan, np.float32)
    for k, mark in enumerate(landmarks):
        marks[:, k] = (*mark, 0)[:3]
    return Arena(
        size_xy=np.array(size_xy, np.float32),
        boxes=Boxes(*rows[:7], overhead=rows[5] > 0, contrast=rows[7], used=used),
        landmarks=Landmarks(
            marks[0],
            marks[1],
            np.zeros(MARKS, np.float32),
            np.nan_to_num(marks[2]).astype(np.int32),
            np.arange(MARKS) < len(landmarks),
        ),
        start_xyyaw=np.array([0.2, 0.7, 0], np.float32),
        goal_xy=np.array([1.6, 0.7], np.float32),
        floor_contrast=np.float32(floor_contrast),
        family=np.int32(-1),
        difficulty=np.float32(0),
    )


def random_scene(seed: int) -> tuple[Arena, Pose]:
    """Up to five boxes, one in three of them overhead, landmarks, and a pose with a view of them."""
    rng = np.random.default_rng(seed)
    boxes = []
    for _ in range(rng.integers(0, SLOTS)):
        over = rng.random() < 1 / 3
        bottom, top = (0.37, 0.5) if over else (0.0, rng.choice([0.03, 0.06, 0.2, 0.5]))
        boxes.append((*rng.uniform([0.5, 0.1, -3, 0.02, 0.02], [1.7, 1.3, 3, 0.15, 0.15]), bottom, top, rng.random()))
    landmarks = [(*rng.uniform([0.3, 0.1], [1.7, 1.3]), rng.integers(2)) for _ in range(rng.integers(0, MARKS + 1))]
    pose = Pose(*(np.float32(v) for v in rng.uniform([0.1, 0.3, 0.0, -0.6], [0.4, 1.1, 0.06, 0.6])))
    return make(boxes, landmarks, floor_contrast=0.8), pose


def pose(x=0.3, y=0.7, z=0.0, yaw=0.0) -> Pose:
    return Pose(*(np.float32(v) for v in (x, y, z, yaw)))
