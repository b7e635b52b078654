"""Parts of a config that may be in separate TOML files, such as a robot or a camera."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pydantic

from jaxbiped.config import Model, input_error, load_toml, refuse_value
from jaxbiped.errors import InputError

FILE = "file"  # key of a table that names one


class FileModel(Model):
    """A model that may be given by a separate TOML file: `"robot.toml"` instead of a table, or a table with a key
    `file`.

    Other values in the table override the file. The rule is the same for the command line, TOML and Python.
    """

    @pydantic.model_validator(mode="before")
    @classmethod
    def _from_file(cls, data: Any) -> Any:
        try:
            return with_file(cls, data)
        except InputError as error:
            refuse_value(str(error))


def with_file(model: type[Model], data: Any) -> Any:
    """The given fields of a model, merged with those of a file named among them.

    Args:
      data: data of the model; returned unchanged if it names no file.

    Raises:
      InputError: a file that is missing, not TOML, or has a wrong field.
    """
    given = {FILE: data} if isinstance(data, str | Path) else data
    if not isinstance(given, Mapping) or FILE not in given:
        return data
    path = given[FILE]
    if not isinstance(path, str | Path):
        raise InputError("must be a TOML file", field=FILE, value=path)
    table = load_toml(path)
    if FILE in table:
        raise InputError("unknown key", file=path, field=FILE)
    try:
        model.model_validate(table)
    except pydantic.ValidationError as error:
        if error.errors()[0]["loc"]:  # otherwise it concerns several fields, and some may be given separately
            raise input_error(error, file=path) from None
    return table | {name: value for name, value in given.items() if name != FILE}
