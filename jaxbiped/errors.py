"""The one exception meant for people: it becomes one line on stderr and exit status 2."""

from __future__ import annotations

import sys
from pathlib import Path


class InputError(ValueError):
    """Input that cannot be used.

    Args:
      message: what is allowed, in one clause.
      file: the file that holds the bad value, if it came from one.
      field: the dotted name of the field or the option.
      value: the bad value itself.
    """

    def __init__(self, message: str, *, file: str | Path | None = None, field: str | None = None, value: object = None):
        self.message, self.file, self.field, self.value = message, file, field, value
        place = ": ".join(str(part) for part in (file, field) if part is not None)
        got = f" (got {_short(value)})" if value is not None else ""
        super().__init__(" ".join(f"{place + ': ' if place else ''}{message}{got}".split()))

    def within(self, file: str | Path) -> InputError:
        """The same error for a value that came from a file."""
        return InputError(self.message, file=file, field=self.field, value=self.value)


def _short(value: object, limit: int = 200) -> str:
    text = repr(_plain(value))
    return text if len(text) <= limit else text[: limit - 3] + "..."


def _plain(value: object) -> object:
    """NumPy scalars and arrays as plain Python values, which people can read: 0.5 and not np.float64(0.5)."""
    np = sys.modules.get("numpy")  # if NumPy was never loaded, no value is its own
    if np is not None and isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if type(value) in (tuple, list):
        return type(value)(_plain(item) for item in value)
    if type(value) is dict:
        return {_plain(key): _plain(item) for key, item in value.items()}
    return value
