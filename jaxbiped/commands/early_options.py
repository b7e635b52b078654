"""Options that decide the defaults of others, read from the command line before the rest of it is parsed."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

from jaxbiped.commands.options.base import FILE_OPTIONS
from jaxbiped.config import Model
from jaxbiped.core.config_file import FILE
from jaxbiped.errors import InputError

RAYS = tuple(f"camera.{name}" for name in ("width", "height", "columns", "rows"))
NUMBERS = {int: re.compile(r"\d{1,9}"), float: re.compile(r"\d{0,9}\.?\d{1,9}")}


def with_early(
    data: dict[str, Any], rest: Sequence[str], options: type[Model], path: Path | None = None
) -> dict[str, Any]:
    """`data` of a TOML file, updated with the options that decide the defaults of others.

    They must be known before the others are read. That includes the camera's size and rays, since the rays of a
    `--preset` only need to match the given size. Values that cannot be right are left for the parser to reject.

    Args:
      rest: the words of the command line.
      path: path of the file.

    Raises:
      InputError: a key of the file that exists only as an option of the command line.
    """
    for name in FILE_OPTIONS:
        if name in data and name in options.model_fields:
            raise InputError("unknown key", file=path, field=name)
    whole = "mission" in options.model_fields
    given = data.get("mission", {}) if whole else data
    found: dict[str, Any] = {}
    parts = options.model_fields["mission"].annotation.model_fields if whole else options.model_fields
    for part, value in files(rest, options):
        if part in parts:  # otherwise the command opens it
            found[part] = {FILE: value}
    if whole:
        for option, value in deciding(rest, options.model_fields["mission"].annotation):
            part, _, name = option.rpartition(".")
            found |= {part: found.get(part, {}) | {name: value}} if part else {name: value}
    if not found or not isinstance(given, Mapping):
        return data
    merged = {**given, **{name: joined(given.get(name), value) for name, value in found.items()}}
    return {**data, "mission": merged} if whole else merged


def joined(given: Any, found: Any) -> Any:
    """A part of the file updated from the command line; a path given instead of a part stands for that file."""
    if not isinstance(found, dict):
        return found
    if isinstance(given, str):
        given = {FILE: given}
    return {**given, **found} if isinstance(given, Mapping) else found


def files(rest: Sequence[str], options: type[Model]) -> Iterator[tuple[str, str]]:
    """Parts of the config for which the command line names a file, with that file."""
    for name, part in FILE_OPTIONS.items():
        word = last_value(part, rest) if name in options.model_fields else None
        if word and not word.startswith("-"):
            yield part, word


def deciding(rest: Sequence[str], mission: type[Model]) -> Iterator[tuple[str, Any]]:
    """Mission options on which others depend, with values that may be valid."""
    from jaxbiped.mission.defaults import DECIDING

    for option in (*DECIDING, *RAYS):
        word, part = last_value(option, rest), option.rpartition(".")[0]
        model = mission.model_fields[part].annotation if part else mission
        kind = model.model_fields[option.rpartition(".")[2]].annotation
        choices = get_args(kind)
        if not word or (choices and word not in choices):
            continue
        if kind not in NUMBERS:
            yield option, word
        elif NUMBERS[kind].fullmatch(word):
            yield option, kind(word)


def last_value(option: str, rest: Sequence[str]) -> str | None:
    """The last value that the command line gives an option; None if it gives none."""
    words = [value_of(option, word, following) for word, following in itertools.pairwise([*rest, ""])]
    words = [word for word in words if word]
    return words[-1] if words else None


def value_of(option: str, word: str, following: str) -> str | None:
    """The value that a word of the command line (and the next word) gives the option; None for other words."""
    name, equals, value = word.partition("=")
    if name.replace("_", "-") != f"--{option.replace('_', '-')}":
        return None
    return value if equals else following
