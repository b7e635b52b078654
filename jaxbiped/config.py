"""Read TOML files into frozen pydantic models, with errors that name file, field, value and what is allowed."""

from __future__ import annotations

import ast
import hashlib
import inspect
import itertools
import json
import re
import textwrap
import tomllib
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import pydantic
from pydantic_core import PydanticCustomError

from jaxbiped.errors import InputError
from jaxbiped.files import read_text


class Model(pydantic.BaseModel):
    """Base of every configuration model: frozen, no unknown keys, no NaN or infinity."""

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


M = TypeVar("M", bound=Model)


def field_docs(model: type[Model]) -> dict[str, str]:
    """The docstring of each field that has one. Reading the source takes long, so this is for help only."""
    found = {}
    for kind in reversed(inspect.getmro(model)):
        if not issubclass(kind, Model):
            continue
        (made,) = ast.parse(textwrap.dedent(inspect.getsource(kind))).body
        for field, text in itertools.pairwise(made.body):
            if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant):
                found[field.target.id] = inspect.cleandoc(text.value.value)
    return found


# Our messages for pydantic's error types; the fields come from the error's context.
SAID = {
    "missing": "is required",
    "extra_forbidden": "unknown key",
    "greater_than": "must be greater than {gt:g}",
    "greater_than_equal": "must be greater than or equal to {ge:g}",
    "less_than": "must be less than {lt:g}",
    "less_than_equal": "must be less than or equal to {le:g}",
    "multiple_of": "must be a multiple of {multiple_of:g}",
    "finite_number": "must be finite",
    "bool_type": "must be true or false",
    "bool_parsing": "must be true or false",
    "literal_error": "must be {expected}",
    "enum": "must be {expected}",
    "union_tag_invalid": "must be one of {expected_tags}",
    "union_tag_not_found": "is required",
    "too_short": "must have at least {min_length} item(s)",
    "too_long": "must have at most {max_length} item(s)",
    "string_too_short": "must have at least {min_length} character(s)",
    "string_too_long": "must have at most {max_length} character(s)",
    "string_pattern_mismatch": "must match {pattern}",
    "int_parsing_size": "is too large",
} | {
    name: f"must be {what}"
    for what, names in {
        "a number": "float_type float_parsing",
        "a whole number": "int_type int_parsing int_from_float",
        "a string": "string_type path_type bytes_type string_unicode",
        "a list": "tuple_type list_type set_type frozen_set_type iterable_type",
        "a table": "model_type dict_type mapping_type model_attributes_type dataclass_type",
    }.items()
    for name in names.split()
}  # fmt: skip


def load_toml(path: str | Path) -> dict[str, Any]:
    """Read a TOML file; raise `InputError` if it is missing, not text or not TOML."""
    text = read_text(path)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        message, line = toml_problem(text, str(error))
        raise InputError(message, file=path, value=line) from None
    except (ValueError, RecursionError):  # numbers too long, nesting too deep
        raise InputError("is not valid TOML", file=path) from None


def toml_problem(text: str, said: str) -> tuple[str, str]:
    """What is wrong, and where, with a text that `tomllib` rejected with the message `said`; and the line itself."""
    lines = text.rstrip("\n").split("\n")
    place = re.search(r"line (\d+), column (\d+)", said)
    number = min(int(place[1]) if place else len(lines), len(lines))
    where = f"line {number}, column {place[2]}" if place else f"line {number}, the last"
    twice = ", defines a key a second time" if re.search("overwrite|twice|already", said) else ""
    return f"is not valid TOML: {where}{twice}", lines[number - 1].strip()


def parse(model: type[M], data: dict[str, Any], *, file: str | Path | None = None) -> M:
    """Validate `data` as `model`; raise `InputError` about the first error in it."""
    try:
        return model.model_validate(data)
    except pydantic.ValidationError as error:
        raise input_error(error, file=file) from None


def load(model: type[M], path: str | Path) -> M:
    """Read a TOML file as `model`; raise `InputError` about the first error in it."""
    return parse(model, load_toml(path), file=path)


def input_error(error: pydantic.ValidationError, *, file: str | Path | None = None, prefix: str = "") -> InputError:
    """The first problem of a pydantic error as one line; a `prefix` turns fields into options."""
    first = error.errors(include_url=False)[0]
    field = ".".join(str(part) for part in first["loc"]) or None
    message = first["msg"].removeprefix("Value error, ").removeprefix("Assertion failed, ")
    if first["type"] in SAID:
        message = SAID[first["type"]].format(**first.get("ctx", {}))
    value = None if first["type"] == "told" else first["input"]  # the message already has it
    if prefix and field:
        field = prefix + field.removeprefix("mission.").replace("_", "-")
    return InputError(message, file=file, field=field, value=value)


def refuse_value(message: str) -> NoReturn:
    """Raise an error for a pydantic validator whose message already names the wrong value."""
    raise PydanticCustomError("told", "{message}", {"message": message})


def config_hash(model: Model) -> str:
    """Twelve hex digits that change whenever any resolved value of the config does."""
    text = json.dumps(model.model_dump(mode="json"), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:12]
