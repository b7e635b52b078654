"""Find where an image has enough texture for matching.

A semi-global matcher extends disparities from a rim to plain surfaces beside it, by some ten pixels: a wall grows into
the sky behind it, and a lintel downwards. Only pixels with texture of their own can be trusted.
"""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

WINDOW = 7  # [px] in which gradients are averaged, and by which textured regions are narrowed again
LEAST, PER_NOISE = 0.5, 2 / 3  # [grey levels per px] of a mean gradient along rows: constant, and per image noise


def textured(image: UInt8[np.ndarray, "H W"], noise: float) -> Bool[np.ndarray, "H W"]:
    """Pixels of a grey image with a row-wise gradient about them; `noise` is that of a colour channel [grey levels].

    Pure noise has a mean gradient of about 0.2 times its own size. A mean over a window extends beyond the rim of
    textured regions by half the window; that is removed again.
    """
    mean = cv2.boxFilter(np.abs(cv2.Sobel(image, cv2.CV_32F, 1, 0)) / 8, -1, (WINDOW, WINDOW))
    rich = (mean > max(LEAST, PER_NOISE * noise)).astype(np.uint8)
    return cv2.erode(rich, np.ones((WINDOW, WINDOW), np.uint8)) > 0
