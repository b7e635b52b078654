"""Files of the cache: each is complete and unchanged, or treated as absent.

A file is written under another name and then renamed: many processes may do so at once. It begins with a line that
identifies it and with a hash of the rest: a file that is damaged, truncated, of another kind or not readable is
ignored. If a folder cannot be created, read or written, nothing is kept.
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
    """The data that `write` stored there, now marked as most recently used; None if there are none."""
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
    """Store `data`, replacing what was there; return whether that was possible."""
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
    used: float  # [s] last use, since the epoch


def files(folder: Path) -> list[Kept]:
    """All files in a folder and below it, most recently used first; none if the folder does not exist."""
    found = []
    for place, _, names in os.walk(folder):
        for name in names:
            path = Path(place) / name
            with contextlib.suppress(OSError):  # removed in the meantime
                status = path.lstat()
                found.append(Kept(path, status.st_size, status.st_mtime))
    return sorted(found, key=lambda file: file.used, reverse=True)


def prune(folder: Path, most: int) -> None:
    """Remove the least recently used files of a folder until the rest is at most `most` bytes."""
    total = 0
    for file in files(folder):
        total += file.size
        if total > most:
            with contextlib.suppress(OSError):
                file.path.unlink(missing_ok=True)
    remove_empty(folder)


def remove_empty(folder: Path) -> None:
    """Remove the empty folders below a folder."""
    for place, _, _ in os.walk(folder, topdown=False):
        if Path(place) != folder:
            with contextlib.suppress(OSError):  # not empty
                os.rmdir(place)
