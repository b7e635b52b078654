"""One writer at a time for a results folder."""

from __future__ import annotations

import fcntl
import os
import socket
from pathlib import Path

from jaxbiped.errors import InputError
from jaxbiped.files import reason

LOCK = ".lock"


class FolderLock:
    """An advisory lock (flock) on `.lock` in a folder. The system releases it when its process dies, however it dies.

    Raises `InputError` that names the holder if another process, or this one, already holds it.
    """

    def __init__(self, folder: str | Path):
        self.path = Path(folder) / LOCK
        while True:
            try:
                self.descriptor = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o666)
            except OSError as error:
                raise InputError(f"cannot be written: {reason(error)}", file=self.path) from None
            try:
                fcntl.flock(self.descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if self.is_current():
                    os.truncate(self.descriptor, 0)
                    os.write(self.descriptor, f"process {os.getpid()} on {socket.gethostname()}\n".encode())
                    return
            except BlockingIOError:
                holder = os.pread(self.descriptor, 200, 0).decode(errors="replace").strip()
                os.close(self.descriptor)
                raise InputError(
                    f"is being written by {holder or 'another process'}; a results folder has one writer",
                    file=self.path.parent,
                ) from None
            except OSError as error:
                os.close(self.descriptor)
                raise InputError(f"cannot be written: {reason(error)}", file=self.path) from None
            os.close(self.descriptor)  # its last holder removed this file between our open and our lock: retry

    def is_current(self) -> bool:
        """Whether the locked file is still the one in the folder."""
        try:
            return os.path.samestat(os.fstat(self.descriptor), os.stat(self.path))
        except FileNotFoundError:
            return False

    def release(self) -> None:
        """Remove the file, then release the lock; doing it again has no effect."""
        if self.descriptor >= 0:
            self.path.unlink(missing_ok=True)
            os.close(self.descriptor)
            self.descriptor = -1
