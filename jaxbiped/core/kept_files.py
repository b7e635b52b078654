"""Files of the cache: each is whole and what it was written as, or it is not there.

A file is written under another name and then renamed: many processes may do so at once. It begins with a line that
says what it is and with a hash of the rest: one that is damaged, cut short, of another kind or not readable is none. A
folder that cannot be made, read or written to is done without.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

DIGEST = 32  # bytes of SHA-256


def read(path: Path, kind: bytes) -> bytes | None:
    """What `write` wrote there, which is now the last to have been used; None where there is no such thing."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    head, digest, rest = data[: len(kind)], data[len(kind) :][:DIGEST], data[len(kind) + DIGEST :]
    if head != kind or hashlib.sha256(rest).digest() != digest:
        return None
    with contextlib.suppress(OSError):
        os.utime(path)
    return rest


def write(path: Path, kind: bytes, data: bytes) -> bool:
    """Keep `data`, in place of what was there; whether it could be."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, prefix=".", delete=False) as file:
            try:
                file.write(kind + hashlib.sha256(data).digest() + data)
                file.close()
                os.replace(file.name, path)
            except OSError:
                with contextlib.suppress(OSError):
                    os.unlink(file.name)
                raise
    except OSError:
        return False
    return True


@dataclass(frozen=True)
class Kept:
    """A file in a folder."""

    path: Path
    size: int  # [bytes]
    used: float  # [s] since the epoch, last


def files(folder: Path) -> list[Kept]:
    """All files in a folder and below it, those first that were used last; none where there is no such folder."""
    found = []
    for place, _, names in os.walk(folder):
        for name in names:
            path = Path(place) / name
            with contextlib.suppress(OSError):  # gone meanwhile
                status = path.lstat()
                found.append(Kept(path, status.st_size, status.st_mtime))
    return sorted(found, key=lambda file: file.used, reverse=True)


def prune(folder: Path, most: int) -> None:
    """Remove the files of a folder that were not used for longest, until the rest is `most` bytes."""
    total = 0
    for file in files(folder):
        total += file.size
        if total > most:
            with contextlib.suppress(OSError):
                file.path.unlink(missing_ok=True)
    remove_empty(folder)


def remove_empty(folder: Path) -> None:
    """Remove the folders below a folder in which nothing is."""
    for place, _, _ in os.walk(folder, topdown=False):
        if Path(place) != folder:
            with contextlib.suppress(OSError):  # not empty
                os.rmdir(place)
