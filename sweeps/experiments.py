"""The six experiments of the paper, ours beside the paper's figures where it gives any (Tables 3 and 4).

    python sweeps/experiments.py [--seeds N]

Each scene is run with several noise seeds; printed are how many reached, and the median distance and time of those.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from jaxbiped.arenas import load_scene
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.settings import MissionConfig, program
from jaxbiped.mission.stepped import run_logged
from jaxbiped.sensing.hashing import from_key

SCENES = Path(__file__).parent.parent / "configs" / "scenes"


@dataclass(frozen=True)
class Experiment:
    """One row: how it is run, and what the paper measured."""

    number: int
    strategy: str
    distance: float | None = None  # [m] (paper, Table 3)
    minutes: float | None = None  # (paper, Tables 3 and 4)


EXPERIMENTS = (
    Experiment(1, "full"),
    Experiment(2, "full"),
    Experiment(3, "full", None, 16.8),
    Experiment(4, "floor_only", 1.33, 17.0),
    Experiment(5, "full", 0.85, 10.0),
    Experiment(6, "full", None, 9.2),
)


def main(seeds: int = 8) -> None:
    """Run all six with `seeds` noise seeds each."""
    table = Table("experiment", "strategy", "reached", "distance", "paper", "time", "paper", title="Medians over seeds")
    config = MissionConfig()
    for item in EXPERIMENTS:
        _, arena = load_scene(SCENES / f"experiment_{item.number}.toml")
        static = program(config, tuple(round(float(v), 6) for v in arena.size_xy))
        settings = config.settings(item.strategy)
        ends = [run_logged(arena, settings, from_key(jax.random.key(seed)), static) for seed in range(seeds)]
        reached = [end for end in ends if end.code == Code.REACHED]
        table.add_row(
            str(item.number),
            item.strategy,
            f"{len(reached)} of {seeds}",
            f"{100 * np.median([end.distance for end in reached]):.0f} cm" if reached else "-",
            f"{100 * item.distance:.0f} cm" if item.distance else "-",
            f"{np.median([end.time for end in reached]) / 60:.1f} min" if reached else "-",
            f"{item.minutes:.1f} min" if item.minutes else "-",
        )
    Console().print(table)


if __name__ == "__main__":
    tyro.cli(main)
