"""Arguments checked by the annotations of a function: its signature and its dataclasses define what is allowed.

For public functions that are written for one arena, and that `jax.vmap` maps over more. Rank, shape and dtype are
checked at every call, also for tracers; the checks cost nothing in a compiled program. Dynamic axes have letters, as in
`Float[Array, "H W"]`: a letter has one size in all arguments of a call, and a layout (an argument with
`axis_sizes`) gives the sizes of some of them. `*B` is for batches: here it stands for no axis.
`axis_sizes`) says what some of them are. `*B` is for batches: in such a function's arguments it stands for no axis.
"""

from __future__ import annotations

import dataclasses
import functools
import importlib
import inspect
import math
import types
import typing
from collections.abc import Callable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped.core import checks
from jaxbiped.errors import InputError

Sizes = dict[str, tuple[int, str]]  # size of each letter, and the argument in which it was first seen
ONE = "; the function is for one arena, use jax.vmap for more"


def checked(*, numbers: tuple[str, ...] = (), late: Mapping[str, str] | None = None) -> Callable[[Callable], Callable]:
    """Decorate a function so that its arguments are checked by their annotations, and are arrays of the right type.

    Real numbers of other types become float32; nested lists and numbers become arrays.

    Args:
      numbers: names of arguments in which NaN is not allowed, if values are concrete.
      late: modules of names in the annotations that the function's own module imports only for type checkers.

    Raises:
      InputError: (the decorated function) about the first invalid argument.
    """

    def decorate(function: Callable) -> Callable:
        signature = inspect.signature(function)

        @functools.cache
        def annotations() -> dict[str, Any]:
            return hints(function, late)

        @functools.wraps(function)
        def checked_function(*args, **kwargs):
            bound = signature.bind(*args, **kwargs)
            sizes: Sizes = {}
            for name, value in bound.arguments.items():
                for letter, size in getattr(value, "axis_sizes", {}).items():
                    sizes[letter] = size, name
            for name, value in bound.arguments.items():
                bound.arguments[name] = check(name, value, annotations()[name], sizes, name not in numbers)
            return function(*bound.args, **bound.kwargs)

        return checked_function

    return decorate


def hints(owner: Any, late: Mapping[str, str] | None = None) -> dict[str, Any]:
    """The annotations of a function or a class, without the result's."""
    names = {name: getattr(importlib.import_module(module), name) for name, module in (late or {}).items()}
    found = typing.get_type_hints(owner, localns=names or None)
    found.pop("return", None)
    return found


fields_of = functools.cache(hints)


def is_array_kind(kind: Any) -> bool:
    """Whether an annotation is one of jaxtyping's, `Float[Array, "H W"]`."""
    return isinstance(kind, type) and hasattr(kind, "dim_str") and hasattr(kind, "dtypes")


def check(name: str, value: Any, kind: Any, sizes: Sizes, nan: bool) -> Any:
    """Check one argument, or a part of it, by its annotation."""
    origin = typing.get_origin(kind)
    if origin in (types.UnionType, typing.Union):
        return check_any(name, value, typing.get_args(kind), sizes, nan)
    if origin is tuple:
        return check_tuple(name, value, typing.get_args(kind), sizes, nan)
    if is_array_kind(kind):
        return check_array(name, value, kind, sizes, nan)
    if dataclasses.is_dataclass(kind):
        if not isinstance(value, kind):
            raise not_a(name, value, kind)
        if not any(is_checked(part) for part in fields_of(kind).values()):
            return value
        parts = {part: getattr(value, part) for part in fields_of(kind)}
        new = {part: check(f"{name}.{part}", parts[part], fields_of(kind)[part], sizes, nan) for part in parts}
        return value if all(new[part] is parts[part] for part in parts) else dataclasses.replace(value, **new)
    if kind in (int, float, bool):
        return check_static(name, value, kind)
    if isinstance(kind, type) and not isinstance(value, kind):
        raise not_a(name, value, kind)
    return value


def not_a(name: str, value: Any, *kinds: type) -> InputError:
    """The error about an argument that is not an instance of any of some classes."""
    return InputError(f"must be {' or '.join(k.__name__ for k in kinds)}, not {type(value).__name__}", field=name)


def is_checked(kind: Any) -> bool:
    """Whether an annotation of a field contains arrays, or dataclasses with arrays; other fields are static."""
    members = typing.get_args(kind) or (kind,)
    return any(is_array_kind(member) or dataclasses.is_dataclass(member) for member in members)


def check_any(name: str, value: Any, kinds: tuple[Any, ...], sizes: Sizes, nan: bool) -> Any:
    """A value with one of several annotations; Python's own numbers, if among them, stay as they are."""
    if value is None and type(None) in kinds:
        return None
    kinds = [kind for kind in kinds if kind is not type(None)]
    tried = [kind for kind in kinds if is_array_kind(kind)] or kinds
    first = None
    for kind in tried:
        try:
            checked_value = check(name, value, kind, sizes, nan)
        except InputError as error:
            first = first or error
        else:
            plain = [k for k in kinds if k in (bool, int, float)]
            return plain[0](value) if plain and isinstance(value, (bool, int, float)) else checked_value
    if len(tried) > 1 and not is_array_kind(tried[0]):
        raise not_a(name, value, *tried)
    raise first


def check_tuple(name: str, value: Any, kinds: tuple[Any, ...], sizes: Sizes, nan: bool) -> tuple:
    """A tuple, part by part."""
    if kinds[-1] is Ellipsis:
        kinds = kinds[:1] * (len(value) if isinstance(value, (tuple, list)) else 0)
    if not isinstance(value, (tuple, list)) or len(value) != len(kinds):
        got = f"one of {len(value)}" if isinstance(value, (tuple, list)) else type(value).__name__
        raise InputError(f"must be a tuple{f' of {len(kinds)}' if kinds else ''}, not {got}", field=name)
    pairs = zip(value, kinds, strict=True)
    new = tuple(check(f"{name}[{i}]", part, kind, sizes, nan) for i, (part, kind) in enumerate(pairs))
    return value if isinstance(value, tuple) and all(a is b for a, b in zip(new, value, strict=True)) else new


def check_static(name: str, value: Any, kind: type) -> Any:
    """A number or a switch that determines the program."""
    allowed = {bool: (bool, np.bool_), int: (int, np.integer), float: (int, float, np.integer, np.floating)}[kind]
    good = isinstance(value, allowed) and (kind is bool or not isinstance(value, bool))
    if not good or (kind is float and math.isnan(value)):
        what = {bool: "True or False", int: "an integer", float: "a number"}[kind]
        shown = value if isinstance(value, (bool, int, float, str)) else type(value).__name__
        raise InputError(f"must be {what}, known before anything is compiled", field=name, value=shown)
    return kind(value)


def check_array(name: str, value: Any, kind: Any, sizes: Sizes, nan: bool) -> Any:
    """An array by its annotation, as float32, bool, uint32 or a signed integer of at most 32 bits."""
    array = checks.as_array(name, value)
    if kind.array_type is np.ndarray:
        if not checks.is_concrete(array):
            raise InputError("must be known: the function runs on the host, outside of jax.jit", field=name)
        array = np.asarray(array)
    what, good = allowed_dtype(kind, array)
    axes = [axis for axis in kind.dim_str.split() if not axis.startswith("*")]
    known = {axis: sizes[axis] for axis in axes if axis in sizes}
    wanted = [int(axis) if axis.isdigit() else known.get(axis, (None,))[0] for axis in axes]
    fits = all(size in (None, given) for size, given in zip(wanted, array.shape, strict=False))
    if not good or array.ndim != len(axes) or not fits:
        said = " and ".join(f"{axis} = {size} as in {origin}" for axis, (size, origin) in known.items())
        hint = ONE if good and array.ndim > len(axes) else ""
        given = f"{checks.described(array)}{hint}"
        raise InputError(f"must be {what} [{', '.join(axes)}]{' with ' * bool(said)}{said}, not {given}", field=name)
    for axis, size in zip(axes, array.shape, strict=True):
        if not axis.isdigit():
            sizes.setdefault(axis, (size, name))
    return as_wanted(name, array, kind, nan)


def allowed_dtype(kind: Any, array: Any) -> tuple[str, bool]:
    """What an annotation allows, in words, and whether an array complies."""
    names = kind.dtypes if isinstance(kind.dtypes, (tuple, list)) else ()
    if "prng_key" in "".join(map(str, names)):
        return "a random key", jnp.issubdtype(array.dtype, jax.dtypes.prng_key)
    if "float32" in names:
        return "real numbers", any(jnp.issubdtype(array.dtype, sort) for sort in (jnp.floating, jnp.integer))
    if tuple(names) == ("uint32",):
        integer = jnp.issubdtype(array.dtype, jnp.integer) and isinstance(array, np.ndarray) and not array.ndim
        return "uint32", array.dtype == np.uint32 or integer
    if "bool" in names:
        return "true or false", array.dtype == np.bool_
    return "integers", jnp.issubdtype(array.dtype, jnp.integer)


def as_wanted(name: str, array: Any, kind: Any, nan: bool) -> Any:
    """An array of an allowed type, converted to the type used by the function."""
    if "float32" in kind.dtypes:
        with np.errstate(over="ignore"):  # values too large for a float32 become infinite
            array = array if array.dtype == np.float32 else array.astype(np.float32)
        if not nan and checks.is_concrete(array) and np.isnan(np.asarray(array)).any():
            raise InputError("must be numbers, not NaN", field=name)
        return array
    if not jnp.issubdtype(array.dtype, jnp.integer):
        return array
    dtype = np.uint32 if tuple(kind.dtypes) == ("uint32",) else np.int32
    if array.dtype == dtype or (dtype is np.int32 and array.dtype in (np.int8, np.int16)):
        return array
    checks.integers(name, array, between=(int(np.iinfo(dtype).min), int(np.iinfo(dtype).max)))
    return checks.narrowed(array, dtype)
