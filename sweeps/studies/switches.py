"""What a switch past the paper gains: missions with it and by the paper's method, on the same arenas and noise.

    python -m sweeps.studies.switches heading [--arenas N] [--executor sampled]       (planning over cells and headings)
    python -m sweeps.studies.switches foot-placement [--arenas N] [--executor native] (feet placed by measured edges)

For foot placement use `native`: `sampled` draws from what was measured of steps that are placed about right, so robots
that place them badly fall more often than simulated ones, which stop at an edge and step back.

Prints how the missions ended, and the paired differences with their intervals, over all arenas and by family: with the
switch minus without. `jaxbiped compare --planner heading`, or `--foot-placement False`, keeps such missions in a
folder, and `jaxbiped compare FOLDER FOLDER` compares two.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import polars as pl
import tyro
from rich.console import Console

from jaxbiped.mission.params import MissionConfig
from jaxbiped.report.tables import terminal
from jaxbiped.statistics.comparison import compare_named
from jaxbiped.statistics.schema import FAMILIES
from jaxbiped.study.config import Family, StrategyName, StudyConfig
from jaxbiped.study.evaluation import evaluate

Executor = Literal["kinematic", "sampled", "native", "mjx"]


@dataclass(frozen=True)
class Switch:
    """One switch: its two positions, and where it is tried by default."""

    on: dict
    off: dict
    executor: Executor
    families: tuple[Family, ...]


SWITCHES = {
    "heading": Switch({"planner": "heading"}, {"planner": "cell"}, "kinematic", FAMILIES),
    "foot-placement": Switch(
        {"foot_placement": True}, {"foot_placement": False}, "native", ("bump", "stairs", "mixed")
    ),
}


def main(
    switch: tyro.conf.Positional[Literal[tuple(SWITCHES)]],
    arenas: int = 600,
    seed: int = 0,
    strategy: StrategyName = "full",
    executor: Executor | None = None,
    families: tuple[Family, ...] | None = None,
) -> None:
    """Run both and compare."""
    chosen, console = SWITCHES[switch], Console(width=110)
    sides = {f"{switch} on": chosen.on, f"{switch} off": chosen.off}
    frames = []
    for name, position in sides.items():
        config = StudyConfig(
            seed=seed,
            arenas=arenas,
            families=families or chosen.families,
            strategies=(strategy,),
            mission=MissionConfig(executor=executor or chosen.executor, **position),
        )
        rows = pl.concat(frame for _, frame in evaluate(config))
        frames.append(rows.with_columns(strategy=pl.lit(name)))
        console.print(f"{name}: {rows['success'].sum()} of {len(rows)} reached the goal", highlight=False)
    console.print(terminal(compare_named(pl.concat(frames), tuple(sides), [tuple(sides)], seed=seed)))


if __name__ == "__main__":
    tyro.cli(main)
