"""A key of everything that a compiled program is traced from: equal in every process, different after any change."""

from __future__ import annotations

import dataclasses
import enum
import hashlib
import os
import sys
import types
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import jax
import jaxlib
import numpy as np
from jax._src import config

from jaxbiped.core.lazy_loading import IMPORTED, REPLACED

PLAIN = bool | int | float | str | bytes | None
OURS = "jaxbiped"
PACKAGE = Path(__file__).parents[1]
COMPILING = (
    *("jax_disable_most_optimizations", "jax_optimization_level", "jax_exec_time_optimization_effort"),
    *("jax_memory_fitting_level", "jax_memory_fitting_effort"),
)
XLA_FLAGS = os.environ.get("XLA_FLAGS", "")  # as XLA reads them, once
TRUSTED = (
    *("jaxbiped", "pydantic", "dataclasses", "abc", "enum", "typing", "functools", "contextlib", "jaxtyping"),
    *("collections", "beartype"),
)  # modules whose functions appear in our classes


def program_key(name: str, arguments: tuple, static: Any) -> str | None:
    """Forty hex digits of everything that a program is traced from; None if that is not fully known.

    Args:
      name: name of the traced function.
      arguments: arguments of the program: arrays, or anything with a shape and type.
      static: everything else that the program depends on.
    """
    if REPLACED or not has_one_device() or has_foreign_methods():
        return None
    made = hashlib.sha256()
    try:
        for part in (name, *facts(), *described(arguments, traced=True), *described(static)):
            made.update(part.encode() + b"\n")
    except (NotOurs, OSError):
        return None
    return made.hexdigest()[:40]


def has_one_device() -> bool:
    """Whether this process is alone, with one device that nobody has selected explicitly."""
    return jax.process_count() == 1 and len(jax.devices()) == 1 and jax.config.jax_default_device is None


def facts() -> tuple[str, ...]:
    """Facts common to all programs of this process."""
    plain = [value for value in trace_settings() if isinstance(value, PLAIN | enum.Enum)]
    others = {name: value for name, value in jax.config.values.items() if "cache" not in name}
    return (*of_this_machine(), repr(plain), repr(sorted(others.items())), XLA_FLAGS)


@cache
def of_this_machine() -> tuple[str, ...]:
    """Facts that do not change while it runs."""
    device = jax.local_devices()[0]
    client = device.client
    versions = jax.__version__, jaxlib.__version__, np.__version__, client.platform_version
    return package_hash(), *versions, client.platform, device.device_kind


@cache
def package_hash() -> str:
    """Hash of the text of this package, and of its data files.

    Raises:
      OSError: the files cannot be read, are missing, or are not those that were imported.
    """
    made, files = hashlib.sha256(), sorted(PACKAGE.rglob("*"))
    if not any(file.suffix == ".py" for file in files):
        raise OSError
    for file in files:
        if file.suffix in (".py", ".toml"):
            status = file.stat()
            if max(status.st_mtime, status.st_ctime) > IMPORTED:
                raise OSError
            made.update(str(file.relative_to(PACKAGE)).encode() + b"\0" + file.read_bytes() + b"\0")
    return made.hexdigest()


def trace_settings() -> tuple:
    """JAX's settings that change what is traced or compiled."""
    return config.trace_context()


def compile_settings() -> tuple:
    """Further settings that change how it is compiled."""
    return tuple(map(jax.config.values.get, COMPILING))


def has_foreign_methods() -> bool:
    """Whether a class of this package has a function from elsewhere: then somebody has replaced one."""
    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] != OURS or module is None:
            continue
        for kind in list(vars(module).values()):
            if not (isinstance(kind, type) and kind.__module__ == name):
                continue
            for method in list(vars(kind).values()):
                function = getattr(method, "fget", None) or getattr(method, "__func__", method)
                if not isinstance(function, types.FunctionType):
                    continue
                origin = (function.__module__ or OURS).partition(".")[0]
                if origin not in TRUSTED and not origin.startswith("namedtuple_"):
                    REPLACED.add(f"{name}.{kind.__qualname__}.{function.__name__}")
    return bool(REPLACED)


class NotOurs(Exception):
    """A value whose code or state this package does not know."""


def described(value: Any, traced: bool = False) -> Iterator[str]:
    """Texts that are equal for all values that give the same program.

    Args:
      traced: whether leaves are arguments of the program, which depends only on their shapes and types.

    Raises:
      NotOurs: for functions, and classes that are not of this package.
    """
    if value is None or (isinstance(value, PLAIN) and not traced):
        yield repr(value)
    elif isinstance(value, enum.Enum) and our(type(value)):
        yield f"{type(value).__qualname__}.{value.name}"
    elif isinstance(value, tuple | list):
        yield f"{type(value).__name__} {len(value)}"
        if type(value) not in (tuple, list) and not our(type(value)):
            raise NotOurs
        for item in value:
            yield from described(item, traced)
    elif type(value) is dict:
        yield f"dict {len(value)}"
        for key in sorted(value):
            yield repr(key)
            yield from described(value[key], traced)
    elif dataclasses.is_dataclass(type(value)) and our(type(value)):
        yield f"{type(value).__module__}.{type(value).__qualname__}"
        for field in dataclasses.fields(value):
            yield from described(getattr(value, field.name), traced and not field.metadata.get("static", False))
    elif traced and hasattr(value, "shape") and hasattr(value, "dtype"):
        weak = getattr(getattr(value, "aval", value), "weak_type", False)
        yield f"{value.dtype} {tuple(value.shape)} {weak}"
    elif traced and isinstance(value, bool | int | float):
        yield type(value).__name__
    else:
        raise NotOurs


def our(kind: type) -> bool:
    """Whether a class is of this package."""
    return kind.__module__.partition(".")[0] == OURS
