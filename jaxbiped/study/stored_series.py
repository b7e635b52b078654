"""Any two stored sides, side by side: two strategies, two sweep points, or two folders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from jaxbiped.errors import InputError
from jaxbiped.statistics.comparison import QUESTION, Comparison, compare_named
from jaxbiped.statistics.schema import ordered
from jaxbiped.study.store import Manifest, read, read_points


@dataclass(frozen=True)
class Stored:
    """A results folder, read."""

    folder: Path
    frame: pl.DataFrame  # rows of `schema.SCHEMA`
    manifest: Manifest
    points: pl.DataFrame  # `point` and a column for each swept field


@dataclass(frozen=True)
class Side:
    """One strategy at one sweep point of one folder."""

    stored: Stored
    strategy: str
    point: int
    name: str = ""  # display name, distinct from the other side's
    rows: pl.DataFrame | None = None

    @property
    def values(self) -> dict[str, float]:
        """The values of the swept fields here."""
        row = self.stored.points.filter(pl.col("point") == self.point).row(0, named=True)
        return {name: value for name, value in row.items() if name != "point"}


def open_stored(folder: str | Path) -> Stored:
    """Read a results folder.

    Raises:
      InputError: results that are missing, damaged or still empty.
    """
    frame, manifest = read(folder)
    if frame.is_empty():
        raise InputError("has no rows to compare yet", file=folder)
    return Stored(Path(folder), frame, manifest, read_points(folder))


def choose(
    stored: Sequence[Stored],
    strategies: tuple[str | None, str | None] = (None, None),
    points: tuple[int | None, int | None] = (None, None),
) -> tuple[Side, Side]:
    """Two sides of one folder, or one side of each of two folders.

    Args:
      strategies: of the first and the second side. By default from the first folder: if points or folders differ, the
        same for both; else the project's question, or the first two that exist.
      points: sweep points; the first by default 0, the second by default that of the first.

    Raises:
      InputError: not one or two folders, a strategy or point that does not exist, or twice the same side.
    """
    if len(stored) not in (1, 2):
        raise InputError("must be one results folder, or two", field="folders", value=len(stored))
    folders = (stored[0], stored[-1])
    first_point = 0 if points[0] is None else points[0]
    points = (first_point, first_point if points[1] is None else points[1])
    there = [present(folder.frame) for folder in folders]
    first, second = strategies
    if len(stored) == 2 or points[0] != points[1]:
        first = first or second or there[0][0]
        second = second or first
    else:
        usual = QUESTION if set(QUESTION) <= set(there[0]) else there[0]
        first = first or next((name for name in usual if name != second), second)
        second = second or next((name for name in (*usual[1:], *there[0]) if name != first), first)
    sides = tuple(Side(*side) for side in zip(folders, (first, second), points, strict=True))
    for side, option in zip(sides, ("first", "second"), strict=True):
        check(side, option)
    if len(stored) == 1 and sides[0].strategy == sides[1].strategy and points[0] == points[1]:
        raise InputError(
            "must differ from the first side in strategy, sweep point or folder", field="second", value=second
        )
    return named(sides, two_folders=len(stored) == 2)


def present(frame: pl.DataFrame) -> tuple[str, ...]:
    """The strategies that have rows, in the order of tables."""
    return ordered(frame["strategy"].unique())


def check(side: Side, option: str) -> None:
    """Raise `InputError` unless a side has rows."""
    file = side.stored.folder
    if side.strategy not in present(side.stored.frame):
        allowed = f"must be one of {', '.join(present(side.stored.frame))}"
        raise InputError(allowed, file=file, field=option, value=side.strategy)
    count = len(side.stored.points)
    if not 0 <= side.point < count:
        allowed = f"must be a sweep point of the folder, 0 to {count - 1}" if count > 1 else "must be 0, the only point"
        raise InputError(allowed, file=file, field=f"{option}-point", value=side.point)


def named(sides: tuple[Side, Side], two_folders: bool) -> tuple[Side, Side]:
    """The sides with their rows, and with names that say only what differs between them."""
    values = [side.values for side in sides]
    folders = [side.stored.folder.name for side in sides]
    if folders[0] == folders[1]:
        folders = [str(side.stored.folder) for side in sides]
    fields = [name for name in values[0] | values[1] if values[0].get(name) != values[1].get(name)]
    result = []
    for side, folder, value in zip(sides, folders, values, strict=True):
        said = [f"{name.rpartition('.')[2]} {value[name]:g}" for name in fields if name in value]
        if not said and sides[0].point != sides[1].point:
            said = [f"point {side.point}"]
        name = f"{side.strategy} ({', '.join([folder] * two_folders + said)})" if two_folders or said else side.strategy
        rows = side.stored.frame.filter((pl.col("point") == side.point) & (pl.col("strategy") == side.strategy))
        result.append(Side(side.stored, side.strategy, side.point, name, rows))
    return tuple(result)


def check_same_arenas(first: Side, second: Side) -> None:
    """Raise `InputError` with the difference unless arena k is the same on both sides."""
    one, other = first.stored, second.stored
    if one.manifest.seed != other.manifest.seed:
        message = f"seeds differ, and so do the arenas: {one.manifest.seed} in {one.folder}, {other.manifest.seed} here"
        raise InputError(message, file=other.folder)
    columns = ["arena", "family", "difficulty"]
    both = first.rows.select(columns).join(second.rows.select(columns), on="arena", suffix="_second")
    if both.is_empty():
        raise InputError(f"has no arena in common with {one.folder}", file=other.folder)
    apart = both.filter(
        (pl.col("family") != pl.col("family_second")) | (pl.col("difficulty") != pl.col("difficulty_second"))
    )
    if len(apart):
        row = apart.sort("arena").row(0, named=True)
        here, there = (f"{row[f'family{end}']} of difficulty {row[f'difficulty{end}']:.3f}" for end in ("_second", ""))
        message = f"families differ: arena {row['arena']} is {there} in {one.folder}, {here} here"
        raise InputError(message, file=other.folder)


def side_by_side(first: Side, second: Side) -> pl.DataFrame:
    """The rows of both sides on the arenas that both have; `strategy` holds the sides' names, `point` is 0.

    Raises:
      InputError: the arenas are not the same.
    """
    check_same_arenas(first, second)
    frames = []
    for side, other in ((first, second), (second, first)):
        rows = side.rows.join(other.rows.select("arena"), on="arena", how="semi")
        frames.append(rows.with_columns(strategy=pl.lit(side.name), point=pl.lit(0, pl.Int32)))
    return pl.concat(frames, how="diagonal").sort("arena", maintain_order=True)  # metrics of only one side: null


def compare_sides(
    first: Side, second: Side, *, seed: int | None = None, resamples: int = 4999, level: float = 0.95
) -> tuple[Comparison, pl.DataFrame]:
    """Compare two sides, over all arenas and in strata; also return the rows that were compared.

    Args:
      seed: seed of the bootstraps; by default the study's.
    """
    frame = side_by_side(first, second)
    names = (first.name, second.name)
    seed = first.stored.manifest.seed if seed is None else seed
    shown = second.stored.manifest.metrics | first.stored.manifest.metrics
    options = {"shown": shown, "seed": seed, "resamples": resamples, "level": level}
    return compare_named(frame, names, [names], point=first.point, **options), frame
