"""Stereo pairs whose disparity is known in closed form."""

from __future__ import annotations

import cv2
import numpy as np

SHAPE = (192, 320)  # rows, columns
MARGIN = 160  # [px] of texture on each side of the left image


def texture(shape, seed=0):
    """Noise of several octaves, of mean 0 and standard deviation 1."""
    rng = np.random.default_rng(seed)
    total = np.zeros(shape, np.float32)
    for scale in (1, 2, 4, 8, 16):
        small = rng.normal(size=(shape[0] // scale + 2, shape[1] // scale + 2)).astype(np.float32)
        total += cv2.resize(small, shape[::-1], interpolation=cv2.INTER_CUBIC)
    return total / total.std()


def ramp(a=12.0, across=0.0, down=0.1, *, noise=1.5, contrast=25.0, plain=None, shape=SHAPE, seed=0):
    """(left, right, disparity) of one textured plane, whose disparity is a + across * column + down * row [px].

    Both images are drawn from one painting: the left one shows it as it is, the right one shows at column u what the
    left one shows at u + d. `noise` [grey levels] differs in the two. `plain` = (rows, columns), slices of the left
    image that show no texture.
    """
    rows, columns = shape
    painting = 120 + contrast * texture((rows, columns + 2 * MARGIN), seed)
    if plain is not None:
        area = plain[1]
        painting[plain[0], area.start + MARGIN : area.stop + MARGIN] = 120
    v, u = np.mgrid[:rows, :columns].astype(np.float32)
    disparity = a + across * u + down * v
    source = (u + a + down * v) / (1 - across)  # the left column that a right column shows
    rng = np.random.default_rng(seed + 1)

    def shown(at):
        image = cv2.remap(painting, (at + MARGIN).astype(np.float32), v, cv2.INTER_CUBIC)
        return np.clip(np.round(image + noise * rng.normal(size=shape)), 0, 255).astype(np.uint8)

    return shown(u), shown(source), disparity
