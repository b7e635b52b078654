"""A results folder: rows as Parquet shards and a JSON manifest that says what they are.

    <folder>/manifest.json          written before any row, so that the content can always be identified
    <folder>/points.parquet         the sweep points: `point`, and a column for each field that is swept
    <folder>/rows/part-00000.parquet  the rows of one block of arenas, or of another unit that the writer numbers

Every file is either complete or absent; a shard that exists is done. A stopped study is therefore its manifest and some
of its shards, and the numbers of the missing ones say what is left to do (`study.resumption`).
"""

from __future__ import annotations

import contextlib
import io
import re
import time
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

import polars as pl

from jaxbiped.config import Model, config_hash
from jaxbiped.errors import InputError
from jaxbiped.files import reason, write_whole
from jaxbiped.mission.metric import MetricFormat
from jaxbiped.statistics.schema import ADDED, METRIC_NAME, SCHEMA, ordered, validate
from jaxbiped.study.lock import LOCK, FolderLock
from jaxbiped.study.manifest import MANIFEST, UNREADABLE, Manifest, device, read_manifest, versions
from jaxbiped.study.shard_files import ROWS, broken_shard, shard_number, shard_path, shard_paths
from jaxbiped.terminal import command_line

POINTS = "points.parquet"


class StoredRows(NamedTuple):
    """The content of a results folder: `read(folder).rows`, or `rows, manifest = read(folder)`."""

    rows: pl.DataFrame  # of `schema.SCHEMA`, sorted by sweep point, arena and strategy
    manifest: Manifest


@dataclass(frozen=True)
class StudyHeader:
    """What a results folder says about its study before it has any rows."""

    config: Model  # resolved; its values and its hash are stored
    seed: int
    arenas: int
    points: pl.DataFrame | None = None  # of a sweep: `point`, and a column for each field
    command: str | None = None  # the command line; None: this process's
    device_name: str = ""  # where it is computed; "": the devices that JAX sees
    metrics: Mapping[str, MetricFormat] | None = None  # how the numbers in the columns of metrics are displayed


class Store:
    """A results folder open for writing. Made by `create`; a context manager that does not finish the study by itself.

    If left by an exception, or without `finish`, the manifest says "stopped"; a folder without shards is removed.
    """

    def __init__(self, folder: Path, manifest: Manifest, lock: FolderLock, made: bool):
        self.folder, self.manifest, self.lock, self.made = folder, manifest, lock, made
        self.started = time.monotonic()
        self.before = manifest.wall_time or 0.0, manifest.compile_time or 0.0  # [s] spent by the runs before this one

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def append(self, frame: pl.DataFrame, shard: int | None = None, *, compile_time: float | None = None) -> Path:
        """Write rows as one shard, `rows/part-<shard>.parquet`; by default the next number.

        With `compile_time` [s], of this run so far, the times in the manifest are updated, so that they survive if the
        run is killed.

        Raises `InputError` if the rows do not fit the schema, the shard already exists, or the disk is full.
        """
        done = self.done()
        shard = max(done, default=-1) + 1 if shard is None else shard
        path = shard_path(self.folder, shard)
        if shard in done:
            raise InputError("this shard is already written", file=path)
        buffer = io.BytesIO()  # polars would raise its own error on a full disk
        validate(frame).write_parquet(buffer)
        write_whole(path, lambda file: file.write(buffer.getvalue()))
        if compile_time is not None:
            self.write_manifest(**self.times(compile_time))
        return path

    def times(self, compile_time: float | None, wall_time: float | None = None) -> dict[str, float | None]:
        """Times of the manifest: seconds of all runs; this run's are `wall_time`, by default those since it was
        opened."""
        wall = time.monotonic() - self.started if wall_time is None else wall_time
        spent = None if compile_time is None else self.before[1] + compile_time
        return {"wall_time": self.before[0] + wall, "compile_time": spent}

    def done(self) -> set[int]:
        """Numbers of the shards that are written."""
        return {shard_number(path) for path in shard_paths(self.folder)}

    def finish(self, *, compile_time: float | None = None, wall_time: float | None = None) -> Manifest:
        """Write the final manifest and release the folder. Times are of this run; by default all of it."""
        rows = int(scan(self.folder).select(pl.len()).collect().item())
        times = self.times(compile_time, wall_time)
        self.write_manifest(state="finished", shards=len(self.done()), rows=rows, **times)
        self.close()
        return self.manifest

    def write_manifest(self, **changes: Any) -> None:
        """Replace the manifest with a changed one."""
        self.manifest = self.manifest.model_copy(update=changes)
        text = self.manifest.model_dump_json(indent=2) + "\n"
        write_whole(self.folder / MANIFEST, lambda file: file.write(text.encode()))

    def close(self) -> None:
        """Release the folder; mark it "stopped" if it is not finished, remove it if nothing was written."""
        if self.lock.descriptor < 0:
            return
        try:
            if self.manifest.state == "running":
                if self.done():
                    self.write_manifest(state="stopped")
                else:
                    for name in (MANIFEST, POINTS):
                        (self.folder / name).unlink(missing_ok=True)
                    remove_if_empty(self.folder / ROWS)
        except (InputError, OSError):
            pass  # a full disk: "running" without a lock reads as stopped
        finally:
            self.lock.release()
            if self.made:
                remove_if_empty(self.folder)


def create(folder: str | Path, header: StudyHeader) -> Store:
    """Create a results folder: take its lock, write its sweep points and its manifest.

    Args:
      folder: must not exist, or be empty.
    """
    folder = Path(folder)
    refuse_filled(folder)
    manifest = Manifest(
        state="running",
        command=header.command if header.command is not None else command_line(),
        config=header.config.model_dump(mode="json"),
        config_hash=config_hash(header.config),
        versions=versions(),
        device=header.device_name or device(),
        seed=header.seed,
        arenas=header.arenas,
        metrics=dict(header.metrics or {}),
        started=datetime.now(UTC).isoformat(timespec="seconds"),
    )
    made = not folder.exists()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = FolderLock(folder)
    except (OSError, InputError) as error:
        if made:
            remove_if_empty(folder)
        raise as_input_error(folder, error) from None
    try:
        refuse_filled(folder)  # another process may have come and gone before we got the lock
    except InputError:
        lock.release()
        raise
    store = Store(folder, manifest, lock, made)
    try:
        (folder / ROWS).mkdir()
        if header.points is not None:
            write_points(folder, header.points)
        store.write_manifest()
    except (OSError, InputError) as error:
        store.close()
        raise as_input_error(folder, error) from None
    return store


def write_points(folder: Path, points: pl.DataFrame) -> None:
    """Write the sweep points."""
    buffer = io.BytesIO()
    points.write_parquet(buffer)
    write_whole(folder / POINTS, lambda file: file.write(buffer.getvalue()))


def as_input_error(folder: Path, error: OSError | InputError) -> InputError:
    """The one-line error about a folder that cannot be created or filled."""
    return error if isinstance(error, InputError) else InputError(f"cannot be written: {reason(error)}", file=folder)


def remove_if_empty(folder: Path) -> None:
    """Remove a folder if it is empty."""
    with contextlib.suppress(OSError):
        folder.rmdir()


def refuse_filled(folder: Path) -> None:
    """Raise `InputError` unless the folder is new or empty."""
    if folder.exists() and not folder.is_dir():
        raise InputError("is a file; a results folder must be new or empty", file=folder)
    if folder.is_dir() and any(path.name != LOCK for path in folder.iterdir()):
        raise InputError("exists and is not empty; a results folder must be new or empty", file=folder)


def read(folder: str | Path) -> StoredRows:
    """The rows of a folder and its manifest. An unfinished study reads as the rows that it has so far; see
    `Manifest.state`.

    Raises:
      InputError: what is missing or broken, by name.
    """
    manifest = read_manifest(folder)
    frames = []
    for path in shard_paths(folder):
        try:
            frames.append(validate(pl.read_parquet(path), file=path))
        except InputError:
            raise
        except UNREADABLE as error:
            raise broken_shard(path, error) from None
    check_complete(folder, manifest, sum(len(frame) for frame in frames))
    frame = pl.concat(frames, how="diagonal") if frames else pl.DataFrame(schema=SCHEMA)
    strategy = pl.col("strategy").cast(pl.Enum(ordered(frame["strategy"].unique())))
    return StoredRows(validate(frame, file=folder).sort("point", "arena", strategy), manifest)


def scan(folder: str | Path) -> pl.LazyFrame:
    """All rows as a lazy frame, in order of the shards: for studies that do not fit in memory.

    Only the shards' footers are read and checked here.
    """
    paths, wanted = shard_paths(folder), dict(SCHEMA)
    for path in paths:
        try:
            schema = dict(pl.read_parquet_schema(path))
        except UNREADABLE as error:
            raise broken_shard(path, error) from None
        measured = {name: kind for name, kind in schema.items() if name not in SCHEMA}
        own = {name: kind for name, kind in schema.items() if name in SCHEMA}
        if {name: SCHEMA[name] for name in ADDED} | own != dict(SCHEMA) or not all(
            re.fullmatch(METRIC_NAME, name) and kind == pl.Float64 for name, kind in measured.items()
        ):
            message = f"is not a shard of this format; its columns must be {', '.join(SCHEMA)}, and metrics"
            raise InputError(message, file=path)
        wanted |= measured
    if not paths:
        return pl.LazyFrame(schema=SCHEMA)
    return pl.scan_parquet(paths, schema=wanted, missing_columns="insert")


def read_points(folder: str | Path) -> pl.DataFrame:
    """The sweep points of a folder: `point` (Int32, ascending from 0), and a column (Float64) for each swept field.

    A study that sweeps nothing has one point, 0, and no fields.
    """
    read_manifest(folder)
    path = Path(folder) / POINTS
    if not path.exists():
        return pl.DataFrame({"point": [0]}, schema={"point": pl.Int32})
    try:
        points = pl.read_parquet(path)
    except UNREADABLE as error:
        raise broken_shard(path, error) from None
    fields = [name for name in points.columns if name != "point"]
    wanted = {"point": pl.Int32, **dict.fromkeys(fields, pl.Float64)}
    if dict(points.schema) != wanted or points["point"].to_list() != list(range(len(points))):
        raise InputError("must hold `point`, ascending from 0, and a column of numbers for each swept field", file=path)
    return points


def check_complete(folder: str | Path, manifest: Manifest, rows: int) -> None:
    """Raise `InputError` if a finished study has lost rows."""
    if manifest.state != "finished":
        return
    shards = len(shard_paths(folder))
    if (manifest.shards, manifest.rows) != (shards, rows):
        message = f"{shards} shards with {rows} rows, where the manifest says {manifest.shards} with {manifest.rows}"
        raise InputError(message, file=Path(folder) / ROWS)
