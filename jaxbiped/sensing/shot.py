"""The result of one stereo measurement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, UInt8

from jaxbiped.sensing.view import Sightings, View


@dataclass(frozen=True)
class Shot:
    """One measurement: the robot's data, and the pictures that they come from."""

    view: View  # [N]
    sightings: Sightings  # [L]
    left: UInt8[np.ndarray, "H W 3"]
    disparity: Float32[np.ndarray, "H W"]  # [px]; 0 where not measured
