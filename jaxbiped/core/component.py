"""Requirements on users' components: a frozen dataclass that is a pytree of numbers."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped.errors import InputError

C = TypeVar("C")


def check_component(thing: object, base: type, where: str, hint: str = "") -> None:
    """Raise `InputError` unless an object can take part in a compiled program.

    Args:
      base: required base class.
      where: the name with which messages begin.
      hint: advice for objects of other classes.
    """
    kind = type(thing).__name__
    if not isinstance(thing, base):
        raise InputError(f"must be a {base.__name__}, not {kind}{hint}", field=where)
    leaves = jax.tree.leaves(thing)
    if len(leaves) == 1 and leaves[0] is thing:
        raise InputError(f"{kind} is not a pytree; decorate it with jax.tree_util.register_dataclass", field=where)
    for leaf in leaves:
        try:
            jnp.asarray(leaf)
        except TypeError:
            message = f"{kind} holds a {type(leaf).__name__}; fields that are not numbers must be static"
            raise InputError(message, field=where) from None
    for item in fields(thing) if is_dataclass(thing) else ():
        if item.metadata.get("static"):
            try:
                hash(getattr(thing, item.name))
            except TypeError:
                raise InputError(f"{kind} has a static field that cannot be hashed: {item.name}", field=where) from None


def as_component(thing: object, base: type[C], where: str) -> C:
    """The component given as an object of a class derived from `base`, or as the class.

    Raises:
      InputError: anything else.
    """
    if isinstance(thing, type) and issubclass(thing, base):
        thing = thing()
    check_component(thing, base, where)
    return thing


def traced_component(component: C) -> C:
    """A component with its numbers as arrays of the types used in programs."""
    return jax.tree.map(lambda leaf: np.asarray(leaf, jax.dtypes.canonicalize_dtype(np.asarray(leaf).dtype)), component)


def numbers_of(component: Any) -> tuple[str, ...]:
    """The fields of a component that a sweep may change: those with one number each."""
    if component is None or not is_dataclass(component):
        return ()
    names = [f.name for f in fields(component) if not (f.metadata.get("static") or f.metadata.get("derived"))]
    values = {name: np.asarray(getattr(component, name)) for name in names}
    return tuple(name for name, value in values.items() if value.ndim == 0 and value.dtype.kind in "iuf")


def with_numbers(component: C, numbers: dict[str, float]) -> C:
    """The component with those of the numbers that it has."""
    known = {name: float(numbers[name]) for name in numbers_of(component) if name in numbers}
    return replace(component, **known) if known else component


def kind_of(component: Any) -> tuple:
    """The key of its compiled program: the structure of the component, and the shapes of its numbers."""
    leaves, structure = jax.tree.flatten(component)
    return structure, *((np.shape(leaf), np.asarray(leaf).dtype.kind) for leaf in leaves)
