"""An arena from a few arrays, for users' generators."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxbiped.arenas.arena import Arena, Landmarks
from jaxbiped.arenas.families import LANDMARKS_KIND, LANDMARKS_X, LANDMARKS_Y, MAX_BOXES, SIZE_X, SIZE_Y
from jaxbiped.arenas.scene import BoxConfig
from jaxbiped.errors import InputError
from jaxbiped.geometry.boxes import Boxes, plan_distance

COLUMNS = "x, y, yaw, length, width, bottom, top"
COVERED = 0.08  # [m] landmarks nearer than this to a box are left out


def make_arena(
    boxes: Any,
    start: Any,
    goal: Any,
    *,
    size: Sequence[float] = (SIZE_X, SIZE_Y),
    difficulty: Float[Array, ""] | float = 0.0,
    landmarks: Landmarks | None = None,
) -> Arena:
    """An arena of boxes on a flat floor. All numbers may be traced: a generator computes them from its random key.

    Args:
      boxes: [M, 7]: centre x and y [m], yaw [rad], length along it and width across it [m], and the heights of its
        bottom and top [m]; a box with a bottom above 0 hangs overhead. A box whose top is not above its bottom, or that
        has no length or width, is absent, so that a generator with a varying number of boxes can always return as many
        rows. A list may hold `Box` objects, which are not traced, instead of rows.
      start: x, y [m] and yaw [rad].
      goal: x, y [m].
      size: [m] of the area, which starts at the origin; not traced.
      difficulty: 0 (easy) to 1 (hard): tables and figures show thirds of it.
      landmarks: by default those of the built-in families, unless covered by a box, scaled to the area.

    Raises:
      InputError: arrays of other shapes, or a size that is not positive.
    """
    contrast = 1.0
    if isinstance(boxes, list | tuple):
        contrast = jnp.array([box.contrast if isinstance(box, BoxConfig) else 1.0 for box in boxes], jnp.float32)
        boxes = [_row(box) if isinstance(box, BoxConfig) else box for box in boxes]
    elif not hasattr(boxes, "__len__"):
        raise InputError(f"must be a list of boxes or an array [M, 7]: {COLUMNS}", field="boxes", value=type(boxes))
    rows = _array("boxes", boxes if len(boxes) else jnp.zeros((0, 7)), (None, 7), f"[M, 7]: {COLUMNS}")
    start = _array("start", start, (3,), "x, y, yaw")
    goal = _array("goal", goal, (2,), "x, y")
    if len(size) != 2 or not all(0 < side <= 1000 for side in size):
        raise InputError("must be two lengths above 0 m", field="size", value=size)
    slots = max(MAX_BOXES, rows.shape[0])  # as in random arenas, so that they share compiled programs
    x, y, yaw, length, width, bottom, top = jnp.pad(rows, ((0, slots - rows.shape[0]), (0, 0))).T
    used = (top > bottom) & (length > 0) & (width > 0)
    seen = jnp.ones(slots).at[: len(rows)].set(contrast)
    placed = Boxes(x, y, yaw, length / 2, width / 2, bottom, top, bottom > 0, seen, used)
    return Arena(
        size_xy=jnp.array(size, jnp.float32),
        boxes=placed,
        landmarks=_landmarks(placed, size) if landmarks is None else landmarks,
        start_xyyaw=start,
        goal_xy=goal,
        floor_contrast=jnp.float32(1.0),
        family=jnp.int32(-1),
        difficulty=jnp.asarray(difficulty, jnp.float32),
    )


def _row(box: BoxConfig) -> tuple[float, ...]:
    """The values of `COLUMNS` for a box."""
    return *box.centre, box.yaw, *box.size, box.bottom, box.top


def _landmarks(boxes: Boxes, size: Sequence[float]) -> Landmarks:
    x, y = jnp.array(LANDMARKS_X) * (size[0] / SIZE_X), jnp.array(LANDMARKS_Y) * (size[1] / SIZE_Y)
    covered = jax.vmap(lambda px, py: jnp.any(boxes.used & (plan_distance(boxes, px, py) < COVERED)))(x, y)
    return Landmarks(x, y, jnp.zeros(len(LANDMARKS_X)), jnp.array(LANDMARKS_KIND), ~covered)


def _array(name: str, value: Any, shape: tuple, wanted: str) -> Float[Array, "..."]:
    try:
        made = jnp.asarray(value, jnp.float32)
    except (TypeError, ValueError):
        raise InputError(f"must be numbers: {wanted}", field=name) from None
    if made.ndim != len(shape) or any(side not in (None, found) for side, found in zip(shape, made.shape, strict=True)):
        raise InputError(f"must be {wanted}, not of shape {list(made.shape)}", field=name)
    return made
