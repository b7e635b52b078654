"""Table 1 of the paper, from missions: what each strategy passes, and what it measures."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Bool, Int

from jaxbiped.arenas import Arena
from jaxbiped.mapping import Cell, truth_grid
from jaxbiped.mission.params import MissionConfig, mission_spec
from jaxbiped.mission.recorded_driver import Mission

SCENES = {  # scene: the classes that its only path leads over, or around
    "table_1_floor": (Cell.FLOOR,),
    "table_1_obstacle": (Cell.OBSTACLE,),
    "table_1_bump": (Cell.BUMP,),
    "table_1_gate": (Cell.GATE,),
    "table_1_both": (Cell.BUMP, Cell.GATE),
}
ENOUGH = 0.5  # share of the measured true cells that must be classified correctly for a class to count as measured


@dataclass(frozen=True)
class Shown:
    """The result of one mission in a test scene."""

    passed: bool  # whether its goal was reached
    code: str
    measured: bool  # whether the scene's classes are in the robot's final map
    share: float  # share of its measured true cells that are correct, the lowest of its classes


def shown(arena: Arena, mission: Mission, config: MissionConfig, kinds: tuple[Cell, ...]) -> Shown:
    """The result of a mission for some classes."""
    grid = mission_spec(config, tuple(round(float(v), 6) for v in arena.size_xy)).grid
    truth, _ = truth_on(arena, grid, config.robot.body())
    share = min(right(mission.log.classes[-1], np.asarray(truth), kind) for kind in kinds)
    return Shown(mission.code.label == "reached", mission.code.label, share >= ENOUGH, share)


truth_on = jax.jit(truth_grid, static_argnames=("spec",))


def right(classes: Int[np.ndarray, "H W"], truth: Int[np.ndarray, "H W"], kind: Cell) -> float:
    """Share of a class's measured true cells in or right beside which the class was measured.

    At least a quarter of a class must be measured; a neighbouring cell counts, because a face may lie on a cell's edge.
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
