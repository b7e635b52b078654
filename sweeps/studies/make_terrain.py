"""Writes the elevation map of configs/terrain/stairs.toml: `python -m sweeps.studies.make_terrain`.

An 8 bit picture, a pixel a centimetre and a grey level a millimetre: rough ground, stairs of three steps of 3 cm that
lead up to a landing, a wall beside them, and rubble that is too high to step on. All of it is made up.
"""

from pathlib import Path

import cv2
import numpy as np

FILE = Path(__file__).parents[2] / "configs" / "terrain" / "stairs.png"
SIZE = 1.8, 1.4  # [m]
PIXEL, GREY = 0.01, 0.001  # [m]
TREADS, STEP = (0.60, 0.85, 1.10), 0.03  # [m] where steps begin to rise, over a pixel, and how high they are
WALL = 0.20  # [m] high, along the side of the stairs
ROUGH = 0.001  # [m] of the ground, one standard deviation


def stairs() -> np.ndarray:
    """Heights [m], row 0 of least y."""
    rng = np.random.default_rng(1)
    shape = tuple(round(size / PIXEL) + 1 for size in SIZE[::-1])
    x, y = np.meshgrid(np.arange(shape[1]) * PIXEL, np.arange(shape[0]) * PIXEL)
    heights = STEP * sum((x > tread + 1e-9).astype(float) for tread in TREADS)
    bumps = cv2.GaussianBlur(rng.normal(size=shape), (0, 0), 3.0)
    heights += ROUGH * bumps / bumps.std()
    heights[(y > 1.15) & (x > 0.5)] = WALL
    rubble = (np.hypot(x - 0.43, y - 0.60) < 0.05) | (np.hypot(x - 0.62, y - 0.22) < 0.05)
    heights[rubble] += 0.05
    return heights.clip(0)


def main() -> None:
    """Write the picture, its top row that of greatest y."""
    grey = np.rint(stairs()[::-1] / GREY).astype(np.uint8)
    cv2.imwrite(str(FILE), grey, [cv2.IMWRITE_PNG_COMPRESSION, 9])
    print(f"{FILE}: {FILE.stat().st_size} bytes")


if __name__ == "__main__":
    main()
