"""Digests of users' code, so that two studies with different code are not mistaken for the same."""

from __future__ import annotations

import functools
import hashlib
import inspect
import re
import types
from collections.abc import Iterator, Mapping
from typing import Any

import jax
import numpy as np

OURS = "jaxbiped"
ADDRESS = re.compile(r" at 0x[0-9a-fA-F]+")
# Modules of classes that components extend, by their former names: these are in the hashes of stored studies.
FORMER = {
    "jaxbiped.executors.execution": "jaxbiped.mission.execution",
    "jaxbiped.executors.built_in": "jaxbiped.mission.executors",
}
PLAIN = bool | int | float | complex | str | bytes | None


def component_hash(component: Any) -> str:
    """Twelve hex digits of a component's type, code, static fields and numbers.

    The code is the whole text of the modules that define its classes and functions, if they are files, since these call
    other code in them; otherwise, as in a notebook, their own text. Values in closures, defaults and
    `functools.partial` are included. Imports from elsewhere are not covered.
    """
    made = hashlib.sha256()
    for part in parts(component, set()):
        made.update(part.encode() + b"\n")
    return made.hexdigest()[:12]


def parts(value: Any, seen: set[int]) -> Iterator[str]:
    """Texts that change with a value, its code or its content, and that are the same in every process."""
    if isinstance(value, PLAIN):
        yield repr(value)
        return
    if id(value) in seen:
        return
    seen.add(id(value))
    if isinstance(value, types.ModuleType):
        yield value.__name__
    elif isinstance(value, np.ndarray | np.generic | jax.Array) and np.asarray(value).dtype != object:
        array = np.asarray(value)
        yield f"{array.dtype} {array.shape} {array.tobytes().hex()}"
    elif isinstance(value, Mapping):
        for key in sorted(value, key=repr):
            yield from parts(key, seen)
            yield from parts(value[key], seen)
    elif isinstance(value, tuple | list | set | frozenset):
        yield type(value).__name__
        for item in sorted(value, key=repr) if isinstance(value, set | frozenset) else value:
            yield from parts(item, seen)
    elif isinstance(value, type):
        yield from sources(value)
    elif isinstance(value, types.FunctionType):
        yield from sources(value)
        yield from parts([*cells(value), value.__defaults__, value.__kwdefaults__], seen)
    elif isinstance(value, types.MethodType):
        yield from parts([value.__func__, value.__self__], seen)
    elif isinstance(value, functools.partial):
        yield from parts([value.func, value.args, value.keywords], seen)
    elif inner := getattr(value, "__wrapped__", None) or getattr(value, "py_func", None):  # of jax.jit and Numba
        yield from parts(inner, seen)
    else:
        yield from sources(type(value))
        known = getattr(value, "__dataclass_fields__", None)
        held = getattr(value, "__dict__", {}) if known is None else {
            name: getattr(value, name) for name, field in known.items() if not field.metadata.get("derived", False)
        }  # fmt: skip
        if held:
            yield from parts(held, seen)
        else:
            yield ADDRESS.sub("", repr(value))


def cells(function: types.FunctionType) -> list[Any]:
    """The values in a function's closure."""
    held = []
    for cell in function.__closure__ or ():
        try:
            held.append(cell.cell_contents)
        except ValueError:  # not yet filled
            held.append(None)
    return held


def sources(thing: Any) -> Iterator[str]:
    """The name of a class with its bases, or of a function, and the text of their modules, except ours."""
    classes = inspect.getmro(thing) if isinstance(thing, type) else (thing,)
    for item in classes:
        module = getattr(item, "__module__", "") or ""
        module = FORMER.get(module, module)
        yield f"{module if module != '__main__' else ''} {item.__qualname__}"
        if module.partition(".")[0] in (OURS, "builtins"):
            continue
        try:
            yield inspect.getsource(inspect.getmodule(item))
            continue
        except (OSError, TypeError):
            pass
        try:
            yield inspect.getsource(item)
        except (OSError, TypeError):
            functions = [item] if isinstance(item, types.FunctionType) else vars(item).values()
            yield from (compiled(f.__code__) for f in functions if isinstance(f, types.FunctionType))


def compiled(code: types.CodeType) -> str:
    """A text for compiled code that has no source."""
    constants = [compiled(item) if isinstance(item, types.CodeType) else repr(item) for item in code.co_consts]
    return f"{code.co_code.hex()} {constants} {code.co_names}"
