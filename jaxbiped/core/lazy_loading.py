"""Packages whose public names load on first use (PEP 562): a command that needs none of them starts at once."""

from __future__ import annotations

import importlib
import sys
import time
from collections.abc import Mapping
from types import ModuleType
from typing import Any


def lazy_package(package: str, public: Mapping[str, str], modules: str = "") -> None:
    """Give a package its public names and its `__all__`: each is imported at its first use, by any thread.

    Args:
      package: its `__name__`.
      public: names by the module of the package that defines them; `old:new` for renamed ones.
      modules: modules that may be reached by attribute without being imported explicitly.
    """
    origins = {}
    for module, names in public.items():
        for name in names.split():
            there, _, here = name.partition(":")
            origins[here or there] = module, there
    self = sys.modules[package]
    self.__dict__["origins_"] = origins
    self.__dict__["modules_"] = frozenset(modules.split())
    self.__dict__["__all__"] = sorted(origins)
    self.__class__ = LazyPackage


IMPORTED = time.time()  # [s since the epoch] before any other module of the package was read
REPLACED: set[str] = set()  # names replaced in modules of such packages since they were loaded


class WatchedModule(ModuleType):
    """A module that records when its content is replaced: programs traced before are then outdated."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not isinstance(value, ModuleType) and not name.startswith("__"):
            REPLACED.add(f"{self.__name__}.{name}")
        super().__setattr__(name, value)


class LazyPackage(ModuleType):
    """See `lazy_package`."""

    def __getattr__(self, name: str) -> Any:
        origin = self.__dict__["origins_"].get(name)
        if name in self.__dict__["modules_"]:
            return importlib.import_module(f"{self.__name__}.{name}")
        if origin is None:
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        module, there = origin
        value = getattr(importlib.import_module(f"{self.__name__}.{module}"), there)
        self.__dict__[name] = value
        return value

    def __setattr__(self, name: str, value: Any) -> None:
        """If a module and its function have the same name, keep the function: importing sets the module."""
        module, there = self.__dict__["origins_"].get(name, (None, None))
        if type(value) is ModuleType and value.__name__ == f"{self.__name__}.{name}":
            value.__class__ = WatchedModule
        elif not isinstance(value, ModuleType) and not name.startswith("__"):
            REPLACED.add(f"{self.__name__}.{name}")
        if module == name and isinstance(value, ModuleType):
            value = getattr(value, there)
        super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted(
            {*self.__dict__, *self.__dict__["origins_"], *self.__dict__["modules_"]} - {"origins_", "modules_"}
        )
