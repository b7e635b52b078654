"""What `--help` and `--help-all` print: the options that most people need, and all of them."""

from __future__ import annotations

import contextlib
import inspect
import re
import shutil
import textwrap
from collections.abc import Sequence
from pathlib import Path
from types import NoneType
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import pydantic
import tyro

from jaxbiped.commands.options.base import Options
from jaxbiped.config import Model, field_docs

SHORT, ALL = ("-h", "--help"), "--help-all"
WIDEST = 120  # [columns] of a description
NAMED = 2  # groups of options that are named below the short help
LONGEST = 3  # words of the longest default that is shown there
WORDS = {Path: "PATH", str: "NAME", int: "INT", float: "FLOAT"}  # placeholders of values


def is_asked(rest: Sequence[str]) -> bool:
    """Whether the words after a command ask for help."""
    return any(word in (*SHORT, ALL) for word in rest)


def print_help(options: type[Options], command: str, rest: Sequence[str], known: Model | None = None) -> None:
    """Print the help that `rest` asks for: the options that most people need, or all of them.

    Args:
      known: options that a file gives, printed as defaults.
    """
    everything = ALL in rest
    shown, extra = (options, {"default": known} if known else {}) if everything else (basic(options, known), {})
    with contextlib.suppress(SystemExit):
        tyro.cli(shown, prog=f"jaxbiped {command}", args=["--help"], description=paragraphs(options.__doc__), **extra)
    if options.NOTES:
        print(options.NOTES)
    if not everything:
        groups = "".join(f", --{name}.*" for name in hidden_groups(options)[:NAMED])
        print(f"All options{groups}{' ...' if groups else ''}: jaxbiped {command} {ALL}")


def paragraphs(text: str) -> str:
    """A docstring with its paragraphs wrapped to the terminal's width; tyro would join unindented lines."""
    width = min(shutil.get_terminal_size().columns, WIDEST)
    parts = inspect.cleandoc(text).split("\n\n")
    return "\n".join(textwrap.fill(part, width, initial_indent="  ", subsequent_indent="  ") for part in parts)


def basic(options: type[Options], known: Model | None = None) -> type[Model]:
    """A model with the options that most people need, and the first sentence about each; for printing, not for
    parsing."""
    fields = {}
    for dotted in options.BASIC or options.model_fields:
        part, _, name = dotted.rpartition(".")
        model = options.model_fields[part].annotation if part else options
        default = getattr(known, part) if known and part else known
        field, hint = model.model_fields[name], get_type_hints(model, include_extras=True)[name]
        if issubclass_of(field.annotation, Model):
            continue  # a group
        if field.is_required():
            default = ...
        else:
            default = getattr(default, name) if default else field.get_default(call_default_factory=True)
        text = first_sentence(field_docs(model).get(name, ""))
        shown = Annotated[hint, as_shown(hint, text)]
        if default is False:
            shown = Annotated[shown, tyro.conf.FlagCreatePairsOff]  # --no-... changes nothing
        fields[name] = shown, pydantic.Field(default, description=text)
    return pydantic.create_model("Basic", __base__=Model, **fields)


def hidden_groups(options: type[Options]) -> list[str]:
    """Names of the groups of options that `--help` leaves out."""
    models = [options, *(field.annotation for name, field in options.model_fields.items() if name == "mission")]
    groups = [name for model in models for name, field in model.model_fields.items()
              if issubclass_of(field.annotation, Model) and name != "mission"]  # fmt: skip
    return list(dict.fromkeys(groups))


def issubclass_of(kind: Any, base: type) -> bool:
    """Whether a type, or its stand-in, is a class derived from `base`."""
    return isinstance(kind, type) and issubclass(kind, base)


def first_sentence(text: str) -> str:
    """The first sentence of a text, on one line."""
    return re.split(r"(?<=[.?])\s+(?=[A-Z`-])", " ".join(text.split()))[0]


def as_shown(hint: Any, text: str) -> Any:
    """How tyro shows an option of a type: with one word for its value, unless it has its own."""
    own = any(getattr(item, "metavar", None) for item in getattr(hint, "__metadata__", ()))
    return tyro.conf.arg(metavar=None if own else word_for(hint, text), help_behavior_hint=default_hint)


def word_for(kind: Any, text: str) -> str | None:
    """The word for a value of a type, or of a type or None; None if the choices must be shown.

    Args:
      text: the option's help; choices named in it need not be shown again.
    """
    while get_origin(kind) is Annotated:
        kind = get_args(kind)[0]
    inner = [one for one in get_args(kind) if one is not NoneType]
    if get_origin(kind) is Literal:
        return "NAME" if all(re.search(rf"\b{re.escape(str(choice))}\b", text) for choice in inner) else None
    if get_origin(kind) is tuple:
        word = word_for(inner[0], text)
        return f"{word} ..." if word and inner[-1] is ... else None
    if NoneType in get_args(kind) and len(inner) == 1:
        return word_for(inner[0], text)
    return WORDS.get(kind)


def default_hint(label: str) -> str:
    """How a default is shown, unless it is obvious or long."""
    return "" if label in ("None", "False", "True") or len(label.split()) > LONGEST else f"(default: {label})"
