"""The displacements that Table 2 gives durations for."""

from __future__ import annotations

import math

CELL = 0.05  # [m] the length that Table 2 gives durations for
EIGHTH = math.pi / 4  # [rad] the turn that Table 2 gives a duration for
