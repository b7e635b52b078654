"""Check that two pictures form a pair, and which of them is the left one."""

from __future__ import annotations

import cv2
import numpy as np

from jaxbiped.errors import InputError
from jaxbiped.stereo.matching import MatchParams, grey, match

WIDTH = 320  # [px] to which pictures are reduced: only the share of matches is needed
LEAST = 0.05  # smallest share of matching pixels in a pair; fewer match by chance


def check_order(left: np.ndarray, right: np.ndarray, params: MatchParams) -> None:
    """Raise `InputError` if the rectified pictures are swapped, or not a pair.

    Both orders are matched at reduced size. Surfaces that are not shifted to the left in the right picture do not
    match: in swapped pictures, only infinitely distant surfaces do, and chance matches.
    """
    small = max(left.shape[1] / WIDTH, 1.0)
    shape = round(left.shape[1] / small), max(round(left.shape[0] / small), 1)
    pair = [cv2.resize(grey(image), shape, interpolation=cv2.INTER_AREA) for image in (left, right)]
    steps = max(int(np.ceil(params.num_disparities / small / 16)), 1) * 16
    coarse = params.model_copy(
        update={
            "num_disparities": steps,
            "min_disparity": round(params.min_disparity / small),
            "mode": "3way",
            "slanted": False,
        }
    )
    given, swapped = (float(match(*order, coarse).valid.mean()) for order in (pair, pair[::-1]))
    if swapped > 2 * given and swapped > 2 * LEAST:
        message = f"left and right look swapped: {given:.0%} of the pixels match as given, {swapped:.0%} the other way"
        raise InputError(f"{message} round", field="left, right")
    if given < LEAST:
        low, high = params.min_disparity, params.min_disparity + params.num_disparities
        message = (
            f"only {given:.1%} of the pixels match: the pictures are not a rectified pair, show hardly any texture, or "
            f"need another search range than {low} to {high} px"
        )
        raise InputError(message, field="left, right")
