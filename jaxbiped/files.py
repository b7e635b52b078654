"""Files that are either whole or not there, written beside their place, then moved into it; texts and YAML, read."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

import yaml

from jaxbiped.errors import InputError


def write_whole(path: str | Path, write: Callable[[BinaryIO], object]) -> None:
    """Create or replace the file `path` with what `write(file)` writes, all of it or nothing.

    Args:
      path: where the file shall be; its folder must exist.
      write: is given a binary file that is open for reading and writing.

    Raises:
      InputError: the folder does not exist, is not writable, or the disk is full; nothing is left behind.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with open(temporary, "w+b") as file:
            write(file)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        raise InputError(f"cannot be written: {reason(error)}", file=path) from None
    finally:
        temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def new_folder(path: str | Path, field: str = "out") -> Iterator[Path]:
    """A folder to fill, which takes the name `path` when the block ends well and is gone when it does not.

    Args:
      path: where the folder shall be; its parents are made, itself must not exist.
      field: the option that names the folder, for messages.

    Yields:
      A temporary folder beside `path`.

    Raises:
      InputError: `path` exists, cannot be written, or the disk fills up; nothing is left behind.
    """
    path = Path(path)
    refuse_existing(path, field)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        temporary.mkdir(parents=True)
        yield temporary
        refuse_existing(path, field)
        os.rename(temporary, path)
    except OSError as error:
        raise InputError(f"cannot be written: {reason(error)}", file=path, field=field) from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def refuse_existing(path: str | Path, field: str = "out") -> None:
    """Raise `InputError` when `path` exists: results are never mixed or overwritten."""
    if os.path.lexists(path):
        raise InputError("must be a folder that does not exist yet", field=field, value=str(path))


def reason(error: OSError) -> str:
    """What the operating system says about `error`, without its numbers and file names."""
    return (error.strerror or str(error) or type(error).__name__).lower()


def read_text(path: str | Path, *, otherwise: str | None = None) -> str:
    r"""A text of somebody else's in UTF-8, without its byte order mark, its lines ended by \n.

    Lines end where an editor ends them, at \r\n, \n or \r, and nowhere else: `text.split("\n")` gives them, while
    `str.splitlines` would cut at U+2028 and others, which may be part of a name.

    Args:
      path: the file.
      otherwise: the encoding of what is not UTF-8; None refuses it.

    Raises:
      InputError: no such file, one that cannot be read, or no text.
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
    """What a YAML file holds; raises `InputError` when it is missing, no text or no YAML."""
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
    ):  # no characters, dates or numbers; endless nesting
        raise InputError("is not valid YAML", file=path) from None
