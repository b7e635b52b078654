"""Requirements on the heights in any file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float64

from jaxbiped.core.class_grid import MOST_CELLS
from jaxbiped.errors import InputError

GREATEST = 1e4  # [m] largest height; larger values are marks for "no data" that the file does not declare


def check_heights(heights: Float64[np.ndarray, "P Q"], path: Path) -> None:
    """Raise `InputError` unless the heights of a file make a surface."""
    known = heights[np.isfinite(heights)]
    if not known.size:
        message = "must hold heights; all are holes (NaN, no data or transparent)"
        raise InputError(message, file=path, value=f"{heights.size} holes")
    if np.abs(known).max() > GREATEST:
        message = f"must hold heights within {GREATEST:,.0f} m of 0; a mark for unmeasured heights must be declared"
        raise InputError(message, file=path, value=float(known[np.abs(known).argmax()]))
    if known.min() == known.max():
        raise InputError(f"must hold heights that differ; all are {known[0]:g} m", file=path)


def check_shape(rows: int, columns: int, path: Path) -> None:
    """Raise `InputError` about a file with too few or too many heights, before they are decoded."""
    if min(rows, columns) < 2:
        raise InputError("must have at least 2 x 2 heights", file=path, value=f"{rows} x {columns}")
    if rows * columns > MOST_CELLS:
        raise InputError(f"must have at most {MOST_CELLS:,} heights", file=path, value=f"{rows} x {columns}")
