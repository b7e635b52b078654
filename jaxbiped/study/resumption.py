"""Resume a stopped study: its folder is continued only if the result will be as if it had never stopped."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import polars as pl

from jaxbiped import files
from jaxbiped.config import Model
from jaxbiped.errors import InputError
from jaxbiped.statistics.schema import validate
from jaxbiped.study.lock import LOCK, FolderLock
from jaxbiped.study.manifest import MANIFEST, UNREADABLE, Manifest, device, read_manifest, versions
from jaxbiped.study.shard_files import ROWS, broken_shard, shard_number, shard_paths
from jaxbiped.study.store import POINTS, Store, StudyHeader, create

SHOWN = 6  # most differing fields in a message
ABSENT = "nothing"


def resume(folder: str | Path, header: StudyHeader, rows: Sequence[int]) -> Store:
    """A results folder open for writing the rest of a study; a new one if nothing was started there.

    Args:
      header: as for `create`.
      rows: number of rows of each shard, by its number.

    Raises:
      InputError: the folder is finished, is being written, holds something else or a damaged shard, or was started
        with another config, other versions or on another kind of device; nothing is changed then.
    """
    folder = Path(folder)
    if not begun(folder):
        return create(folder, header)
    manifest = read_manifest(folder)
    refuse_finished(folder, manifest)
    refuse_other_config(folder, manifest, header.config)
    refuse_other_program(folder, manifest, header.device_name or device())
    lock = FolderLock(folder)
    try:
        manifest = read_manifest(folder)  # another process may have resumed it before we got the lock
        refuse_finished(folder, manifest)
        check_shards(folder, rows)
        sweep_up(folder)
        store = Store(folder, manifest.model_copy(update={"resumed": manifest.resumed + 1}), lock, made=False)
        store.write_manifest(state="running")
    except BaseException:
        lock.release()
        raise
    return store


def refuse_taken(folder: Path) -> None:
    """Raise `InputError` if a new study cannot be written there, with advice for one that was stopped."""
    if (folder / MANIFEST).exists() and read_manifest(folder).state != "finished":
        message = "holds an unfinished study: --resume continues it"
        raise InputError(message, field="out", value=str(folder))
    files.refuse_existing(folder)


def begun(folder: Path) -> bool:
    """Whether a study wrote its manifest there. What a killed one leaves before that is removed."""
    if not folder.is_dir() or (folder / MANIFEST).exists():
        return folder.is_dir()
    ours = {LOCK, ROWS, POINTS}
    others = [path for path in folder.iterdir() if path.name not in ours and not is_scrap(path)]
    if others or any((folder / ROWS).glob("*")):
        raise InputError(f"is not a results folder; it has no {MANIFEST}", file=folder)
    lock = FolderLock(folder)
    try:
        if not (folder / MANIFEST).exists():
            sweep_up(folder)
            (folder / POINTS).unlink(missing_ok=True)
            if (folder / ROWS).is_dir():
                (folder / ROWS).rmdir()
    finally:
        lock.release()
    return (folder / MANIFEST).exists()


def is_scrap(path: Path) -> bool:
    """Whether a file was being written when its writer was killed (`files.write_whole`)."""
    return path.name.startswith(".") and path.name.endswith(".part")


def sweep_up(folder: Path) -> None:
    """Remove files that a killed writer was writing."""
    for place in (folder, folder / ROWS):
        files.sweep_up(place)


def refuse_finished(folder: Path, manifest: Manifest) -> None:
    """Raise `InputError` if there is nothing to resume."""
    if manifest.state == "finished":
        message = f"this study is finished: nothing to resume; `jaxbiped report {folder}` shows it"
        raise InputError(message, file=folder)


def refuse_other_config(folder: Path, manifest: Manifest, config: Model) -> None:
    """Raise `InputError` that shows the fields in which a config differs from that of the folder."""
    old, new = (dict(leaves(tree)) for tree in (manifest.config, config.model_dump(mode="json")))
    changes = [
        f"{name} {old.get(name, ABSENT)} -> {new.get(name, ABSENT)}"
        for name in dict.fromkeys([*old, *new])
        if name not in old or name not in new or old[name] != new[name]
    ]
    if changes:
        more = f", and {len(changes) - SHOWN} more" if len(changes) > SHOWN else ""
        which = f"{', '.join(changes[:SHOWN])}{more}"
        message = f"was started with another config, and can only be resumed with the same: {which}"
        raise InputError(message, file=folder)


def leaves(tree: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted names and values of all leaves of a config; a list of tables is one leaf."""
    if isinstance(tree, Mapping) and tree:
        items = tree.items()
    elif isinstance(tree, list) and any(isinstance(item, Mapping) for item in tree):
        items = enumerate(tree)
    else:
        yield name, tree
        return
    for key, value in items:
        yield from leaves(value, f"{name}.{key}" if name else str(key))


def refuse_other_program(folder: Path, manifest: Manifest, device_name: str) -> None:
    """Raise `InputError` if rows computed now might differ from those stored."""
    here = versions()
    there = {"device": manifest.device.partition(" x ")[2], **manifest.versions}
    here = {"device": device_name.partition(" x ")[2], **here}
    changes = [
        f"{name} {there.get(name, ABSENT)} (here {value})" for name, value in here.items() if there.get(name) != value
    ]
    if changes:
        message = f"was started with {', '.join(changes)}, and can only be resumed with the same"
        raise InputError(message, file=folder / MANIFEST)


def check_shards(folder: Path, rows: Sequence[int]) -> None:
    """Raise `InputError` about the first shard that this study would not write."""
    for path in shard_paths(folder):
        number = shard_number(path)
        if number >= len(rows):
            raise InputError(f"is not a shard of this study, which has {len(rows)}", file=path)
        try:
            frame = validate(pl.read_parquet(path), file=path)
        except UNREADABLE as error:
            problem = error if isinstance(error, InputError) else broken_shard(path, error)
            raise InputError(f"{problem}; remove this file to have it computed again") from None
        if len(frame) != rows[number]:
            message = f"has {len(frame)} rows, where this study has {rows[number]}; remove it to have it computed again"
            raise InputError(message, file=path)
