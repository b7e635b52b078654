"""The paper's published figures of its experiments (section 3.2, Tables 1, 3 and 4), and the missions that repeat
them."""

from __future__ import annotations

from dataclasses import dataclass

from jaxbiped.motion.config import DurationConfig
from jaxbiped.motion.grid_units import CELL

TABLE_2 = DurationConfig()  # whose defaults are Table 2
GOAL_RADIUS = 0.10  # [m] (paper, 3.1)


@dataclass(frozen=True)
class Experiment:
    """One of the six experiments: how it is repeated, and the paper's measurements."""

    number: int
    strategy: str
    title: str
    figure: int  # of the paper
    distance: float | None = None  # [m] travelled (paper, Table 3)
    minutes: float | None = None  # (paper, Tables 3 and 4)
    straight: float | None = None  # [m] from start to goal (paper, 3.2)
    table: int | None = None  # table that gives its time
    edges: int = 0  # number of bump edges that the robot steps over (paper, 3.2)
    gate: bool = False

    @property
    def scene(self) -> str:
        """Name of its scene file, without the ending."""
        return f"experiment_{self.number}"

    @property
    def way(self) -> float | None:
        """[m] Distance covered by the paper's robot: the published one, else the straight one, which is close to it."""
        return self.distance or self.straight


EXPERIMENTS = (
    Experiment(1, "full", "round a low obstacle", 12),
    Experiment(2, "full", "round an obstacle taller than the camera", 13),
    Experiment(3, "full", "over bumps of 3 and 6 cm", 14, minutes=16.8, straight=1.00, table=4, edges=4),
    Experiment(4, "floor_only", "round the bump, on floor only", 15, distance=1.33, minutes=17.0, table=3),
    Experiment(5, "full", "over the bump", 16, distance=0.85, minutes=10.0, table=3, edges=2),
    Experiment(6, "full", "through the gate", 17, minutes=9.2, straight=1.04, table=4, gate=True),
)
PUBLISHED = tuple(item for item in EXPERIMENTS if item.minutes)
SAVED = (EXPERIMENTS[3].distance - EXPERIMENTS[4].distance, EXPERIMENTS[3].minutes - EXPERIMENTS[4].minutes)
"""[m] and [min] that the paper's robot saved by crossing the bump (Table 3)."""

# Table 1: may the robot move there (O, X), and can it measure it (M, U)? Floor, obstacle, bump, gate.
TABLE_1 = {
    "blind_stop": ("works 4, 5", ("O (M)", "X (M)", "X (M)", "X (U)")),
    "floor_only": ("work 6", ("O (M)", "O (M)", "X (U)", "X (U)")),
    "bump_aware": ("works 7 to 10", ("O (M)", "O (M)", "O (M)", "X (U)")),
    "gate_aware": ("works 11, 12", ("O (U)", "O (M)", "X (U)", "O (M)")),
    "full": ("this study", ("O (M)", "O (M)", "O (M)", "O (M)")),
}


@dataclass(frozen=True)
class Expected:
    """Time of a path by Table 2 alone [s]: straight cells, edges, at least one cell of gate, one measurement per
    cell."""

    cells: float  # of 5 cm, on the whole path
    straight: float
    edges: float
    gate: float
    measuring: float

    @property
    def total(self) -> float:
        """[s]"""
        return self.straight + self.edges + self.gate + self.measuring


def expected(item: Experiment, measure: float) -> Expected | None:
    """Table 2 for the paper's path, with a time for a measurement [s]; None if the paper gives no path."""
    if item.way is None:
        return None
    cells = item.way / CELL
    gate = 1.0 if item.gate else 0.0
    return Expected(
        cells=cells,
        straight=(cells - item.edges - gate) * TABLE_2.straight,
        edges=item.edges * (TABLE_2.step_up + TABLE_2.step_down) / 2,
        gate=gate * TABLE_2.pass_gate,
        measuring=cells * measure,
    )
