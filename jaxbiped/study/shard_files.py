"""The files of a results folder's shards: where they lie, and which there are."""

from __future__ import annotations

from pathlib import Path

from jaxbiped.errors import InputError

ROWS = "rows"  # the folder that they lie in


def broken_shard(path: Path, error: Exception) -> InputError:
    """The one line about a shard that is not a Parquet file, or is cut short."""
    first_line = (str(error).strip() or type(error).__name__).splitlines()[0]
    return InputError(f"is damaged, or no Parquet file: {first_line}", file=path)


def shard_path(folder: str | Path, shard: int) -> Path:
    """Where a shard lies."""
    return Path(folder) / ROWS / f"part-{shard:05d}.parquet"


def shard_number(path: Path) -> int:
    """The number in a shard's name."""
    return int(path.stem.removeprefix("part-"))


def shard_paths(folder: str | Path) -> list[Path]:
    """The shards of a folder in the order of their numbers."""
    return sorted((Path(folder) / ROWS).glob("part-*.parquet"), key=shard_number)
