"""The files of a results folder's shards: where they are, and which exist."""

from __future__ import annotations

from pathlib import Path

from jaxbiped.errors import InputError

ROWS = "rows"  # the folder that contains them


def broken_shard(path: Path, error: Exception) -> InputError:
    """The one-line message about a shard that is not a Parquet file, or is truncated."""
    first_line = (str(error).strip() or type(error).__name__).splitlines()[0]
    return InputError(f"is damaged, or not a Parquet file: {first_line}", file=path)


def shard_path(folder: str | Path, shard: int) -> Path:
    """The path of a shard."""
    return Path(folder) / ROWS / f"part-{shard:05d}.parquet"


def shard_number(path: Path) -> int:
    """The number in a shard's name."""
    return int(path.stem.removeprefix("part-"))


def shard_paths(folder: str | Path) -> list[Path]:
    """The shards of a folder in order of their numbers."""
    return sorted((Path(folder) / ROWS).glob("part-*.parquet"), key=shard_number)
