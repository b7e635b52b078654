"""The displacements for which Table 2 gives durations."""

from __future__ import annotations

import math

CELL = 0.05  # [m] the length for which Table 2 gives durations
EIGHTH = math.pi / 4  # [rad] the turn for which Table 2 gives a duration
