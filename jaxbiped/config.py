"""TOML files into frozen pydantic models, with errors that name file, field, value and what is allowed."""

from __future__ import annotations

import hashlib
import json
import tomllib
from pathlib import Path
from typing import Any, TypeVar

import pydantic

from jaxbiped.errors import InputError


class Model(pydantic.BaseModel):
    """Base of every configuration model: frozen, no unknown keys, no NaN or infinity."""

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True)


M = TypeVar("M", bound=Model)


def load_toml(path: str | Path) -> dict[str, Any]:
    """Read a TOML file; raise `InputError` when it is missing, no text or no TOML."""
    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError("no such file", file=path) from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot be read as text: {error}", file=path) from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"is not valid TOML: {error}", file=path) from None


def parse(model: type[M], data: dict[str, Any], *, file: str | Path | None = None) -> M:
    """Validate `data` as `model`; raise `InputError` about the first thing wrong with it."""
    try:
        return model.model_validate(data)
    except pydantic.ValidationError as error:
        raise input_error(error, file=file) from None


def load(model: type[M], path: str | Path) -> M:
    """Read a TOML file as `model`; raise `InputError` about the first thing wrong with it."""
    return parse(model, load_toml(path), file=path)


def input_error(error: pydantic.ValidationError, *, file: str | Path | None = None) -> InputError:
    """The first problem of a pydantic error as one line."""
    first = error.errors(include_url=False)[0]
    field = ".".join(str(part) for part in first["loc"]) or None
    message = first["msg"].removeprefix("Value error, ")
    if first["type"] == "extra_forbidden":
        message = "unknown key"
    value = None if first["type"] == "told" else first["input"]  # whose message says it
    return InputError(message, file=file, field=field, value=value)


def config_hash(model: Model) -> str:
    """Twelve hex digits that change whenever any resolved value of the config does."""
    text = json.dumps(model.model_dump(mode="json"), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:12]
