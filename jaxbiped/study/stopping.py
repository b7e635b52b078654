"""Stop a study when a difference is known well enough, and the record of it that is kept beside the rows."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import polars as pl

from jaxbiped.config import Model, load_toml, parse
from jaxbiped.files import write_whole
from jaxbiped.statistics.sequential import MEASURES, Goal, Watch, enough, look

STOPPING = "stopping.toml"


class Stopping(Model):
    """How watching a difference ended."""

    measure: Literal[MEASURES]
    first: str
    second: str
    width: float
    """Requested width: [fraction], [m] or [s]."""
    level: float
    looks: int
    arenas: int
    """Number of arenas used."""
    most: int
    """Largest possible number."""
    samples: int
    """Arenas that carry the difference: for distance and time those that both solved."""
    estimate: float | None = None
    low: float | None = None
    high: float | None = None

    @property
    def reached(self) -> bool:
        """Whether the interval is as narrow as requested."""
        return self.low is not None and self.high - self.low <= self.width


class Rule:
    """Called with the rows of each shard of a study; true once they suffice. Writes `stopping.toml` at the end.

    Args:
      goal: the difference to watch.
      folder: folder of the study.
      most: largest number of arenas that the study can have.
    """

    def __init__(self, goal: Goal, folder: str | Path, most: int):
        self.goal, self.folder, self.most = goal, Path(folder), most
        self.watch, self.looks = Watch(), 0

    def __call__(self, frame: pl.DataFrame) -> bool:
        self.watch, self.looks = look(self.watch, self.goal, frame), self.looks + 1
        ends = enough(self.watch, self.goal)
        if ends or self.watch.arenas >= self.most:
            write_stopping(self.folder, self.outcome())  # before the manifest says the study is finished
        return ends

    def outcome(self) -> Stopping:
        """The state so far."""
        goal, watch = self.goal, self.watch
        return Stopping(
            measure=goal.measure,
            first=goal.first,
            second=goal.second,
            width=goal.width,
            level=goal.level,
            looks=self.looks,
            arenas=watch.arenas,
            most=self.most,
            samples=watch.n,
            estimate=watch.estimate.estimate,
            low=watch.estimate.low,
            high=watch.estimate.high,
        )


def write_stopping(folder: str | Path, stopping: Stopping) -> None:
    """Write `stopping.toml` into a results folder."""
    values = stopping.model_dump(exclude_none=True)
    text = "".join(f"{name} = {value!r}\n".replace("'", '"') for name, value in values.items())
    write_whole(Path(folder) / STOPPING, lambda file: file.write(text.encode()))


def read_stopping(folder: str | Path) -> Stopping | None:
    """What `write_stopping` wrote; None if the study was not watched."""
    path = Path(folder) / STOPPING
    return parse(Stopping, load_toml(path), file=path) if path.exists() else None
