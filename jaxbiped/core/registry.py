"""Names of components: one registry for each kind of component.

Names come from this package, from `register`, and from entry points of other packages; `package.module:name` refers to
an object in a module, and needs no registration.
"""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Callable, Iterator
from importlib import metadata
from pathlib import Path
from typing import Generic, TypeVar

from jaxbiped.errors import InputError

T = TypeVar("T")
PLACE = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")  # package.module:name


class Registry(Generic[T]):
    """Names and their entries, in order of registration, which is also the order of tables.

    Args:
      kind: such as "strategy"; for messages.
      group: group of entry points.
    """

    def __init__(self, kind: str, group: str):
        self.kind, self.group = kind, group
        self.held: dict[str, T] = {}

    def add(self, name: str, thing: T, *, replace: bool = False) -> T:
        """Register an entry under a name, and return it.

        Raises:
          InputError: a name that belongs to another entry, unless it is to be replaced.
        """
        taken = self.held.get(name)
        if taken is not None and taken is not thing and not replace and not is_equal(taken, thing):
            raise InputError(f"is taken; two {self.kind} entries cannot have one name", field="name", value=name)
        self.held[name] = thing
        return thing

    def __iter__(self) -> Iterator[str]:
        return iter(self.held)

    def __len__(self) -> int:
        return len(self.held)

    def __contains__(self, name: object) -> bool:
        return name in self.held

    def names(self) -> tuple[str, ...]:
        """All registered names."""
        return tuple(self.held)

    def knows(self, name: str) -> bool:
        """Whether a name is registered, or that of an entry point; nothing is imported."""
        return name in self.held or any(point.name == name for point in self.entry_points())

    def find(self, name: str, convert: Callable[[object, str], T]) -> T:
        """The entry of a name.

        Args:
          convert: makes an entry from an object in a module and its name there.

        Raises:
          InputError: an unknown name, a module that cannot be imported, or that does not contain such an object.
        """
        if name in self.held:
            return self.held[name]
        for point in self.entry_points():
            if point.name == name:
                return self.add(name, convert(load(point.value, self.kind), name))
        if PLACE.fullmatch(name):
            return convert(load(name, self.kind), name.rpartition(":")[2])
        known = ", ".join(dict.fromkeys(self.offered()))
        raise InputError(f"must be one of {known}, or package.module:name", field=self.kind, value=name)

    def offered(self) -> Iterator[str]:
        """All names that are registered or those of entry points."""
        yield from self.held
        yield from (point.name for point in self.entry_points())

    def entry_points(self) -> Iterator[metadata.EntryPoint]:
        """The entry points of other packages."""
        yield from metadata.entry_points(group=self.group)


def known_name(name: str, built_in: tuple[str, ...], registered: Registry, own: str, also: str = "") -> str:
    """The name, if it may be that of a component; nothing is read or imported.

    Args:
      own: what `package.module:name` refers to, in words.
      also: what else is allowed, in words.

    Raises:
      ValueError: what is allowed.
    """
    if not (name in built_in or registered.knows(name) or PLACE.fullmatch(name)):
        known = ", ".join(dict.fromkeys([*built_in, *registered.offered()]))
        raise ValueError(f"must be one of {known}, {also}or package.module:name of your own {own}")
    return name


def is_equal(one: object, other: object) -> bool:
    """Whether two entries are the same; those that cannot be compared, as with fields that are arrays, are not."""
    try:
        return bool(one == other)
    except (TypeError, ValueError):
        return False


STRATEGIES: Registry = Registry("strategy", "jaxbiped.planners")  # filled by `mission.strategies`
FAMILIES: Registry = Registry("family", "jaxbiped.arenas")  # of user families
SENSORS: Registry = Registry("sensor", "jaxbiped.sensors")  # filled by `mission.sensors`
EXECUTORS: Registry = Registry("executor", "jaxbiped.executors")  # filled by `executors.built_in`
METRICS: Registry = Registry("metric", "jaxbiped.metrics")  # filled by `mission.metrics`


def load(place: str, kind: str) -> object:
    """The object at `package.module:name`; modules are also searched in the working directory.

    Raises:
      InputError: no such module or name, or a module that raises an error when it is imported.
    """
    module, _, name = place.partition(":")
    here = str(Path.cwd())
    added = here not in sys.path
    if added:
        sys.path.append(here)
    try:
        found = importlib.import_module(module)
    except Exception as error:
        said = f"{type(error).__name__}: {error}".splitlines()[0]
        raise InputError(f"module {module} cannot be imported: {said}", field=kind, value=place) from None
    finally:
        if added:
            sys.path.remove(here)
    if not hasattr(found, name):
        raise InputError(f"module {module} has no {name}", field=kind, value=place)
    return getattr(found, name)
