"""Table 1 of the paper, as missions show it: what each strategy passes, and what it measures."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Bool, Int

from jaxbiped.arenas import Arena
from jaxbiped.mapping import Cell, truth_grid
from jaxbiped.mission.recorded_driver import Mission
from jaxbiped.mission.settings import MissionConfig, program

SCENES = {  # scene: the classes that its only way leads over, or round
    "table_1_floor": (Cell.FLOOR,),
    "table_1_obstacle": (Cell.OBSTACLE,),
    "table_1_bump": (Cell.BUMP,),
    "table_1_gate": (Cell.GATE,),
    "table_1_both": (Cell.BUMP, Cell.GATE),
}
ENOUGH = 0.5  # of the true cells that were measured have to be classed right, for a class to count as measured


@dataclass(frozen=True)
class Shown:
    """What one mission in a test scene shows."""

    passed: bool  # its goal was reached
    code: str
    measured: bool  # what the scene is about, in the map that the robot held at the end
    share: float  # of its true cells that were measured, the least of its classes


def shown(arena: Arena, mission: Mission, config: MissionConfig, kinds: tuple[Cell, ...]) -> Shown:
    """What a mission shows of some classes."""
    spec = program(config, tuple(round(float(v), 6) for v in arena.size_xy)).spec
    truth, _ = truth_on(arena, spec, config.robot.body())
    share = min(right(mission.log.classes[-1], np.asarray(truth), kind) for kind in kinds)
    return Shown(mission.code.label == "reached", mission.code.label, share >= ENOUGH, share)


truth_on = jax.jit(truth_grid, static_argnames=("spec",))


def right(classes: Int[np.ndarray, "H W"], truth: Int[np.ndarray, "H W"], kind: Cell) -> float:
    """Share of a class's true cells, of those that were measured, that it was measured in or right beside.

    A quarter of a class has to be measured at all; a cell beside counts, because a face may lie on a cell's edge.
    """
    true, seen = truth == kind, classes != Cell.UNMEASURED
    measured = true & seen
    if not true.any() or 4 * measured.sum() < true.sum():
        return 0.0
    return float(grown(classes == kind)[measured].mean())


def grown(mask: Bool[np.ndarray, "H W"]) -> Bool[np.ndarray, "H W"]:
    """A mask with the eight neighbours of each of its cells."""
    padded = np.pad(mask, 1)
    height, width = mask.shape
    return np.logical_or.reduce([padded[i : i + height, j : j + width] for i in range(3) for j in range(3)])
