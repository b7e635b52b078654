"""Where an image has texture enough to be matched.

A semi-global matcher carries disparities over from a rim to plain surfaces beside it, by some ten pixels: a wall grows
into the sky behind it, and a lintel downwards. Only what is textured itself is to be believed.
"""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

WINDOW = 7  # [px] in which gradients are averaged, and by which what is textured is narrowed again
LEAST, PER_NOISE = 0.5, 2 / 3  # [grey levels per px] of a mean gradient along rows: at all, and by the image's noise


def textured(image: UInt8[np.ndarray, "H W"], noise: float) -> Bool[np.ndarray, "H W"]:
    """Pixels of a grey image with a row-wise gradient about them; `noise` is that of a colour channel [grey levels].

    Pure noise has a mean gradient of about 0.2 times its own size. A mean over a window grows over the rim of what is
    textured by half of it; that is taken off again.
    """
    mean = cv2.boxFilter(np.abs(cv2.Sobel(image, cv2.CV_32F, 1, 0)) / 8, -1, (WINDOW, WINDOW))
    rich = (mean > max(LEAST, PER_NOISE * noise)).astype(np.uint8)
    return cv2.erode(rich, np.ones((WINDOW, WINDOW), np.uint8)) > 0
