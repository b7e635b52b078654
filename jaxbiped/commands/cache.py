"""`jaxbiped cache`: show or clear what is kept on disk between processes."""

from __future__ import annotations

import os
from pathlib import Path

from jaxbiped.commands.options.cache import CacheArgs
from jaxbiped.core import kept_files
from jaxbiped.core.cache_location import KERNELS, MOST_PROGRAMS, OFF, PROGRAMS, VARIABLE, cache_folder
from jaxbiped.errors import InputError
from jaxbiped.files import reason

PARTS = {KERNELS: "Numba kernels", PROGRAMS: "XLA programs"}
UNITS = ("B", "kB", "MB", "GB")


def main(args: CacheArgs) -> int:
    """Run the command.

    Returns:
      Exit status 0.

    Raises:
      InputError: with `clear`, a file that cannot be removed; all others are removed.
    """
    folder = cache_folder()
    if folder is None:
        off = os.environ.get(VARIABLE, "").strip().lower() == OFF
        print(f"nothing is kept: {f'{VARIABLE} is {OFF}' if off else 'this user has no cache folder'}")
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
    """A note on a cache folder that is missing or cannot be used; otherwise an empty string."""
    if folder.exists() and not folder.is_dir():
        return " (not a folder: nothing is kept)"
    nearest = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not nearest.is_dir() or not os.access(nearest, os.W_OK | os.X_OK):
        return " (not writable: nothing is added)"
    return "" if folder.exists() else " (does not exist yet)"


def clear(folder: Path) -> None:
    """Remove a folder and the files in it; raise `InputError` about the first that cannot be removed."""
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
    """A number of bytes as readable text."""
    value, units = float(size), list(UNITS)
    while value >= 1000 and len(units) > 1:
        value, units = value / 1000, units[1:]
    return f"{value:.3g} {units[0]}"
