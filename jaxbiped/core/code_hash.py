"""Digests of code that users bring, so that two studies with different code do not pass for the same."""

from __future__ import annotations

import hashlib
import inspect
import types
from typing import Any

import jax
import numpy as np

OURS = "jaxbiped"


def component_hash(component: Any) -> str:
    """Twelve hex digits of a component's type, code, static fields and numbers.

    The code is the whole text of the modules that its classes and functions are from, where there is a file, since
    they call what is beside them; else, as in a notebook, their own text. What they import from elsewhere is not
    covered.
    """
    made = hashlib.sha256()
    for part in (type(component), *functions_in(component)):
        for name, text in sources(part):
            made.update(f"{name}\n{text}\n".encode())
    made.update(type(component).__qualname__.encode())
    for name, field in getattr(component, "__dataclass_fields__", {}).items():
        value = getattr(component, name)
        if field.metadata.get("static", False):
            made.update(f"{name}={named(value)}\n".encode())
        elif not field.metadata.get("derived", False):
            for leaf in map(np.asarray, jax.tree.leaves(value)):
                made.update(f"{name} {leaf.dtype} {leaf.shape}".encode() + leaf.tobytes())
    return made.hexdigest()[:12]


def named(value: Any) -> str:
    """A static value without the address that it has in this process."""
    if isinstance(value, types.FunctionType | types.MethodType | type):
        return f"{value.__module__}.{value.__qualname__}"
    return repr(value) if type(value).__repr__ is not object.__repr__ else type(value).__qualname__


def functions_in(component: Any) -> list[Any]:
    """The functions among its fields, and those that they hold in closures and defaults."""
    fields = getattr(component, "__dataclass_fields__", {})
    found, waiting = [], [getattr(component, name) for name in fields]
    while waiting:
        value = waiting.pop()
        value = getattr(value, "__func__", value)
        if isinstance(value, types.FunctionType) and value not in found:
            found.append(value)
            waiting += [cell.cell_contents for cell in value.__closure__ or ()] + list(value.__defaults__ or ())
    return found


def sources(thing: Any) -> list[tuple[str, str]]:
    """The text of each module that a class with its bases, or a function, is from; ours are left out."""
    classes = inspect.getmro(thing) if isinstance(thing, type) else (thing,)
    texts = []
    for item in classes:
        module = getattr(item, "__module__", "") or ""
        if module.partition(".")[0] == OURS or module == "builtins":
            continue
        try:
            texts.append((module, inspect.getsource(inspect.getmodule(item))))
            continue
        except (OSError, TypeError):
            pass
        try:
            texts.append((item.__qualname__, inspect.getsource(item)))
        except (OSError, TypeError):
            texts.append((item.__qualname__, compiled(item)))
    return texts


def compiled(item: Any) -> str:
    """What code that has no text is compiled to."""
    functions = [item] if isinstance(item, types.FunctionType) else vars(item).values()
    codes = [f.__code__ for f in functions if isinstance(f, types.FunctionType)]
    return "\n".join(f"{code.co_code.hex()} {code.co_consts!r} {code.co_names!r}" for code in codes)
