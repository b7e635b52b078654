"""Files that are either complete or absent: written beside their final path, then moved. Also text and YAML input.

A file being written is hidden, ends in `.part`, and is locked by its writer while that lives. What a killed writer left
is recognised by its lock being free, and removed by the next writer to the same place.
"""

from __future__ import annotations

import contextlib
import fcntl
import glob
import os
import secrets
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

from jaxbiped.errors import InputError

TRIES = 10  # attempts to create a temporary file before another process mistakes it for a dead writer's


def write_whole(path: str | Path, write: Callable[[BinaryIO], object], *, parents: bool = False) -> None:
    """Create or replace the file `path` with what `write(file)` writes, completely or not at all.

    Args:
      path: path of the file; its folder must exist, or is created with `parents`.
      write: called with a binary file that is open for reading and writing.

    Raises:
      InputError: the folder does not exist, is not writable, or the disk is full; nothing is left behind.
    """
    path = Path(path)
    try:
        if parents:
            path.parent.mkdir(parents=True, exist_ok=True)
        with part(path, lambda temporary: temporary.touch(exist_ok=False)) as temporary:
            with open(temporary, "w+b") as file:
                write(file)
                file.flush()
                os.fsync(file.fileno())
            os.replace(temporary, path)
    except OSError as error:
        raise InputError(f"cannot be written: {reason(error)}", file=path) from None


@contextlib.contextmanager
def new_folder(path: str | Path, field: str = "out") -> Iterator[Path]:
    """A folder to fill, renamed to `path` if the block succeeds and removed if it does not.

    Args:
      path: path of the folder, which must not exist; its parents are created.
      field: the option that names the folder, for messages.

    Yields:
      A temporary folder beside `path`.

    Raises:
      InputError: `path` exists, cannot be written, or the disk fills up; nothing is left behind.
    """
    path = Path(path)
    refuse_existing(path, field)
    try:
        with part(path, lambda temporary: temporary.mkdir(parents=True)) as temporary:
            yield temporary
            refuse_existing(path, field)
            os.rename(temporary, path)
    except OSError as error:
        raise InputError(f"cannot be written: {reason(error)}", file=path, field=field) from None


@contextlib.contextmanager
def part(path: Path, make: Callable[[Path], object]) -> Iterator[Path]:
    """A temporary for `path`: created by `make` beside it, locked, and removed when the block ends unless moved."""
    sweep_up(path.parent, path.name)
    for _ in range(TRIES):
        temporary = path.with_name(f".{path.name}.{os.getpid()}-{secrets.token_hex(4)}.part")
        try:
            make(temporary)
            descriptor = os.open(temporary, os.O_RDONLY)
        except FileNotFoundError:
            if not path.parent.is_dir():
                raise
            continue  # removed between being created and being locked
        try:
            with contextlib.suppress(OSError):  # a file system without locks, where nobody removes leftovers either
                fcntl.flock(descriptor, fcntl.LOCK_EX)
            if os.path.lexists(temporary):
                yield temporary
                return
        finally:
            remove(temporary)
            os.close(descriptor)
    raise FileExistsError(f"{path} keeps being removed by another process")


def sweep_up(folder: Path, name: str | None = None) -> None:
    """Remove what killed writers left in a folder; files of living ones are locked, and left alone.

    Args:
      name: name of the file or folder that was being written; by default any.
    """
    for scrap in folder.glob(f".{glob.escape(name) if name else '*'}.*.part"):
        with contextlib.suppress(OSError):
            descriptor = os.open(scrap, os.O_RDONLY | os.O_NONBLOCK)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                remove(scrap)
            finally:
                os.close(descriptor)


def remove(path: Path) -> None:
    """Remove a file, or a folder with its content, as far as possible."""
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)


def refuse_existing(path: str | Path, field: str = "out") -> None:
    """Raise `InputError` if `path` exists: results are never mixed or overwritten."""
    if os.path.lexists(path):
        raise InputError("must be a folder that does not exist yet", field=field, value=str(path))


def reason(error: OSError) -> str:
    """The operating system's message about `error`, without numbers and file names."""
    return (error.strerror or str(error) or type(error).__name__).lower()


def read_text(path: str | Path, *, otherwise: str | None = None) -> str:
    r"""Read someone else's text file in UTF-8, without its byte order mark, with lines ended by \n.

    Lines end where an editor ends them, at \r\n, \n or \r, and nowhere else: `text.split("\n")` gives them, while
    `str.splitlines` would cut at U+2028 and others, which may be part of a name.

    Args:
      path: the file.
      otherwise: the encoding to try for text that is not UTF-8; None rejects it.

    Raises:
      InputError: the file does not exist, cannot be read, or is not text.
    """
    try:
        content = Path(path).read_bytes()
    except FileNotFoundError:
        raise InputError("no such file", file=path) from None
    except OSError as error:
        raise InputError(f"cannot be read: {reason(error)}", file=path) from None
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        if otherwise is None:
            raise InputError("cannot be read as text: it is not in UTF-8", file=path) from None
        text = content.decode(otherwise)
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_yaml(path: str | Path) -> Any:
    """The content of a YAML file; raises `InputError` if it is missing, not text or not YAML."""
    import yaml

    text = read_text(path)
    try:
        return yaml.safe_load(text)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f": line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        raise InputError(f"is not valid YAML{where}", file=path) from None
    except (
        yaml.YAMLError,
        ValueError,
        RecursionError,
    ):  # invalid characters, dates or numbers; endless nesting
        raise InputError("is not valid YAML", file=path) from None
