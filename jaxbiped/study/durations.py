"""Costs from the execution times of the primitives, as the paper chose its own (3.1)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.optimize import nnls

from jaxbiped.executors.motion_library import LibraryConfig
from jaxbiped.motion.config import DurationConfig
from jaxbiped.motion.grid_units import CELL
from jaxbiped.motion.primitives import Command, Primitive, duration

FLOOR_CELL = 2.0  # what a straight move on the floor costs in the paper: C0 + C1
KINDS = {  # primitive: which of C1 to C3 its move costs, and the levels it climbs
    Primitive.STRAIGHT_FORWARD: (1, 0),
    Primitive.PASS_GATE: (2, 0),
    Primitive.STEP_UP_BUMP: (3, 1),
    Primitive.STEP_DOWN_BUMP: (3, -1),
}
LENGTHS = (1.0, math.sqrt(2.0))  # straight and diagonal moves, in cells
ROUNDING = 1e-9  # relative to the longest move; how a zero solution is rounded depends on the processor


@dataclass(frozen=True)
class Fit:
    """The costs that durations imply."""

    costs: Float[np.ndarray, "4"]  # C0 to C3, scaled so that a straight floor move costs 2, as in the paper
    seconds: float  # duration of one unit
    moves: tuple[str, ...]
    measured: Float[np.ndarray, "n"]  # [s] durations of these moves
    fitted: Float[np.ndarray, "n"]  # [s]


def table_2(library: LibraryConfig) -> DurationConfig:
    """Measured primitives in the units of Table 2: 5 cm forward, 45 degrees, one step 5 cm forward, 5 cm of a gate.

    Distance that a measured primitive covers beyond that counts as straight walking, as in `motion.duration`. Without
    a measured `gate`, the squatting walk is used. The duration of a measurement is not known there: the default is
    used.
    """
    entry = library.primitives
    pace = entry["straight"].duration / (entry["straight"].request[0] / CELL)
    gate = entry.get("gate", entry["squat_straight"])

    def step(name: str) -> float:
        cells = entry[name].request[0] / CELL
        return max(entry[name].duration - max(cells - math.sqrt(2.0), 0.0) * pace, 0.0)

    return DurationConfig(
        straight=pace,
        turn=entry["turn"].duration / (abs(entry["turn"].request[2]) / (math.pi / 4)),
        step_up=step("step_up"),
        step_down=step("step_down"),
        pass_gate=gate.duration / (gate.request[0] / CELL),
    )


def fit(durations: DurationConfig, *, diagonal: bool = True, measuring: bool = False) -> Fit:
    """Least squares fit of the durations of moves [s] to their costs (paper, Eq. 1).

    The moves are those of the grid: on the floor, in a gate, one step up, one step down; each straight and, with
    `diagonal`, diagonal. Costs are not negative. C4 cannot be derived from durations: an unmeasured cell takes a
    further measurement, plus whatever turns out to be there.

    Args:
      diagonal: if False, only the sums C0 + C1, C0 + C2 and C0 + C3 are determined; C1 is then C0, as in the paper.
      measuring: a move includes the measurement that follows it.

    Raises:
      ValueError: a straight move on the floor takes no time.
    """
    features, seconds, names = [], [], []
    for primitive, (paid, rise) in KINDS.items():
        for length in LENGTHS if diagonal else LENGTHS[:1]:
            row = np.zeros(4)
            row[0] = length
            row[paid] = 1.0
            command = Command(
                turn=jnp.zeros(1),
                primitive=jnp.full(1, int(primitive)),
                length=jnp.full(1, length * CELL),
                rise=jnp.full(1, rise),
                squat=jnp.zeros(1, bool),
            )
            spent = float(duration(command, jax.tree.map(lambda leaf: leaf[None], durations.traced()))[0])
            features.append(row)
            seconds.append(spent + measuring * durations.measure)
            names.append(f"{primitive.name.lower()}{'' if length == 1 else ' diagonal'}")
    design, measured = np.array(features), np.array(seconds)
    if diagonal:
        found, _ = nnls(design, measured)
    else:
        merged = np.column_stack([design[:, 0] + design[:, 1], design[:, 2:]])
        both, _ = nnls(merged, measured)
        found = np.array([both[0], *both])
    unit = (found[0] + found[1]) / FLOOR_CELL
    if not unit > ROUNDING * measured.max():
        raise ValueError("a straight move on the floor must take time")
    return Fit(found / unit, float(unit), tuple(names), measured, design @ found)
