"""`jaxbiped cache`: what is kept on disk between processes, shown or cleared."""

from __future__ import annotations

import os
from pathlib import Path

from jaxbiped.commands.options.cache import CacheArgs
from jaxbiped.core import kept_files
from jaxbiped.core.cache_location import KERNELS, MOST_PROGRAMS, OFF, PROGRAMS, VARIABLE, cache_folder
from jaxbiped.errors import InputError
from jaxbiped.files import reason

PARTS = {KERNELS: "kernels of Numba", PROGRAMS: "programs of XLA"}
UNITS = ("B", "kB", "MB", "GB")


def main(args: CacheArgs) -> int:
    """Run the command.

    Returns:
      Exit status 0.

    Raises:
      InputError: with `clear`, something that cannot be removed; all else is removed.
    """
    folder = cache_folder()
    if folder is None:
        off = os.environ.get(VARIABLE, "").strip().lower() == OFF
        print(f"nothing is kept: {f'{VARIABLE} is {OFF}' if off else 'this user has no folder'}")
        return 0
    print(f"folder    {folder}{state(folder)}")
    for name, what in PARTS.items():
        found = kept_files.files(folder / name)
        limit = f", at most {amount(MOST_PROGRAMS)}" if name == PROGRAMS else ""
        print(f"{name:<9} {len(found)} {what}, {amount(sum(file.size for file in found))}{limit}")
    if args.clear:
        for name in PARTS:
            clear(folder / name)
        print("cleared")
    return 0


def state(folder: Path) -> str:
    """What is said of a folder in which nothing can be kept, or nothing is yet."""
    if folder.exists() and not folder.is_dir():
        return " (no folder: nothing is kept)"
    nearest = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not nearest.is_dir() or not os.access(nearest, os.W_OK | os.X_OK):
        return " (cannot be written to: nothing is added)"
    return "" if folder.exists() else " (not there yet)"


def clear(folder: Path) -> None:
    """Remove the files of a folder, and the folder; `InputError` about the first that cannot be."""
    first = None
    for file in kept_files.files(folder):
        try:
            file.path.unlink(missing_ok=True)
        except OSError as error:
            first = first or InputError(f"cannot be removed: {reason(error)}", file=file.path)
    kept_files.remove_empty(folder)
    if first:
        raise first


def amount(size: int) -> str:
    """Bytes, for people."""
    value, units = float(size), list(UNITS)
    while value >= 1000 and len(units) > 1:
        value, units = value / 1000, units[1:]
    return f"{value:.3g} {units[0]}"
