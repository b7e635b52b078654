"""Files that are either whole or not there."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from jaxbiped.errors import InputError


def write_atomically(path: str | Path, data: bytes) -> None:
    """Write a file by way of a temporary one in the same folder, synced to the disk before it takes its name.

    Raises `InputError` when the file cannot be written (a full disk, no permission); the temporary file is removed
    and a file that was there before is untouched.
    """
    path = Path(path)
    temporary = None
    try:
        descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, 0o666 & ~current_umask())  # mkstemp's files are private
        os.replace(temporary, path)
        sync_folder(path.parent)
    except BaseException as error:
        if temporary is not None:
            Path(temporary).unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise cannot_write(path, error) from None
        raise


def cannot_write(path: str | Path, error: OSError) -> InputError:
    """The one line about a file that the system refuses to write."""
    reason = error.strerror or str(error)
    return InputError(f"cannot be written: {reason}; a writable place with free space is needed", file=path)


def sync_folder(folder: Path) -> None:
    """Make the names in a folder durable too."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def current_umask() -> int:
    """The process's file mode mask; reading it means setting it for a moment."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
