"""The missions in a results folder: one recorded mission, several, or those of a study, which are played again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import polars as pl

from jaxbiped.errors import InputError
from jaxbiped.mission.recording import FILE
from jaxbiped.study.manifest import MANIFEST
from jaxbiped.study.replay import mission_of, play_again
from jaxbiped.study.stored_series import Side, Stored, check, open_stored, present
from jaxbiped.viewer.mission_file import Shown, ending, shown

FAILURES = 40  # failures listed per strategy; any other can be chosen by its number
KEPT = 8  # number of recently played missions kept


@dataclass(frozen=True)
class Choice:
    """A mission of a results folder, with its name in a list."""

    label: str
    arena: int = 0  # of a study; else the number of the file


Place = tuple[str, int, int]  # strategy, sweep point, arena


@runtime_checkable
class Missions(Protocol):
    """The interface through which the page offers missions. A folder of files has one strategy and one point,
    unnamed."""

    strategies: tuple[str, ...]
    points: tuple[str, ...]

    def choices(self, strategy: str, point: int) -> tuple[Choice, ...]:
        """Missions worth seeing, with the default first."""
        ...

    def open(self, strategy: str, point: int, arena: int) -> Shown:
        """Open one of them. InputError: it does not exist, or cannot be played here."""
        ...


@dataclass(frozen=True)
class Files:
    """Recorded missions of a folder: of `jaxbiped run`, which is one, or of a folder of such folders."""

    folder: Path
    paths: tuple[Path, ...]
    strategies: tuple[str, ...] = ("",)
    points: tuple[str, ...] = ("",)

    def choices(self, strategy: str = "", point: int = 0) -> tuple[Choice, ...]:
        """All of them, by the names of their folders."""
        places = [path.parent.relative_to(self.folder) for path in self.paths]
        names = [str(place) if place.parts else self.folder.name for place in places]
        return tuple(Choice(name, k) for k, name in enumerate(names))

    def open(self, strategy: str = "", point: int = 0, arena: int = 0) -> Shown:
        """Read one."""
        if not 0 <= arena < len(self.paths):
            allowed = f"must be 0 to {len(self.paths) - 1}: {', '.join(each.label for each in self.choices())}"
            raise InputError(allowed, file=self.folder, field="arena", value=arena)
        return shown(self.paths[arena])


class Study:
    """Missions of `jaxbiped compare` or `jaxbiped sweep`: only their ends are stored; they are replayed to be shown."""

    def __init__(self, stored: Stored):
        self.stored = stored
        self.strategies = present(stored.frame)
        self.points = tuple(self.point_name(row) for row in stored.points.sort("point").iter_rows(named=True))
        self.kept: dict[Place, Shown] = {}

    def point_name(self, row: Mapping[str, Any]) -> str:
        """A sweep point as text, by its swept fields."""
        said = ", ".join(f"{name.rpartition('.')[2]} {row[name]:g}" for name in row if name != "point")
        return f"{row['point']}: {said}" if said else "0"

    def rows(self, strategy: str, point: int) -> pl.DataFrame:
        """Rows of one strategy at one point. InputError: there are no such rows."""
        check(Side(self.stored, strategy, point), "strategy")
        return self.stored.frame.filter((pl.col("strategy") == strategy) & (pl.col("point") == point))

    def choices(self, strategy: str, point: int) -> tuple[Choice, ...]:
        """The median, the best and the worst in time of those that arrived, and those that failed."""
        return choices(self.rows(strategy, point))

    def open(self, strategy: str, point: int, arena: int) -> Shown:
        """Replay one; this compiles a mission, once for each config."""
        rows = self.rows(strategy, point).filter(pl.col("arena") == arena)
        if rows.is_empty():
            found = self.stored.frame["arena"]
            allowed = f"must be an arena that was stored, {found.min()} to {found.max()}"
            raise InputError(allowed, file=self.stored.folder, field="arena", value=arena)
        key = (strategy, point, arena)
        if key not in self.kept:
            while len(self.kept) >= KEPT:
                del self.kept[next(iter(self.kept))]
            self.kept[key] = self.play(rows.row(0, named=True))
        return self.kept[key]

    def play(self, row: Mapping[str, Any]) -> Shown:
        """Replay the mission of a row."""
        manifest, arena, strategy = self.stored.manifest, row["arena"], row["strategy"]
        values = Side(self.stored, strategy, row["point"]).values
        mission = play_again(manifest, row["point"], values, strategy, [arena])[0]
        config = mission_of(manifest, row["point"], values)[0]
        note = (
            f"{row['family']}, difficulty {row['difficulty']:.2f}; sensor {config.sensor}, executor {config.executor}"
        )
        if len(self.points) > 1:
            note += f"; point {self.points[row['point']]}"
        if row["code"] != mission.code.label:
            note += f". It ended as {row['code'].replace('_', ' ')} when it was stored"
        facts = {"distance": mission.distance, "measurements": mission.measurements}
        return Shown(mission.log, config, f"arena {arena}, {strategy}", ending(mission.log, facts), note)


def choices(rows: pl.DataFrame) -> tuple[Choice, ...]:
    """Missions worth seeing among rows of one strategy: median, best and worst time, then failures by their codes."""
    arrived = rows.filter(pl.col("success")).sort("time", "arena")
    found = []
    if len(arrived):
        for name, k in (("median", (len(arrived) - 1) // 2), ("best", 0), ("worst", len(arrived) - 1)):
            row = arrived.row(k, named=True)
            found.append(Choice(f"{name}: arena {row['arena']}, {row['time'] / 60:.1f} min", row["arena"]))
    failed = rows.filter(~pl.col("success")).sort("code", "arena")
    for row in failed.head(FAILURES).iter_rows(named=True):
        found.append(Choice(f"{row['code'].replace('_', ' ')}: arena {row['arena']}, {row['family']}", row["arena"]))
    return tuple(found)


def missions(result: Path) -> Missions:
    """The missions of a result.

    Args:
      result: a folder of `jaxbiped run`, `compare` or `sweep`, a folder of several of `run`, or a recorded mission.

    Raises:
      InputError: the folder does not exist, or has nothing to show.
    """
    if result.is_file():
        return Files(result.parent, (result,))
    if not result.is_dir():
        raise InputError("no such results folder", file=result)
    if (result / MANIFEST).is_file():
        return Study(open_stored(result))
    paths = sorted(result.rglob(FILE))
    if not paths:
        raise InputError(
            f"has nothing to show: neither {FILE}, of `jaxbiped run`, nor {MANIFEST}, of a study", file=result
        )
    return Files(result, tuple(paths))
