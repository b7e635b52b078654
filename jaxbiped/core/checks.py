"""Checks of the arguments of public functions: rank, shape and dtype at every call, values where they are concrete.

Under `jit` and `vmap`, values are not known when a function is called. Functions whose result depends on a value that
this module would reject document what they do in that case.
"""

from __future__ import annotations

from typing import Any

import jax
import numpy as np

from jaxbiped.errors import InputError


def is_concrete(array: Any) -> bool:
    """Whether the values of an array are known, that is, not traced."""
    return not isinstance(array, jax.core.Tracer)


def as_array(name: str, value: Any) -> np.ndarray | jax.Array:
    """Arrays unchanged; numbers and nested lists as NumPy arrays.

    Raises:
      InputError: a value that is not an array of numbers.
    """
    if isinstance(value, (np.ndarray, jax.Array)):
        return value
    try:
        array = np.asarray(value)
    except ValueError:  # rows of different length
        array = np.empty(0, object)
    if array.dtype.kind not in "biuf":
        raise InputError(f"must be an array of numbers, not {type(value).__name__}", field=name)
    return array


def integers(name: str, value: Any, core: str = "", between: tuple[int, int] | None = None) -> np.ndarray | jax.Array:
    """An array of integers, checked.

    Args:
      name: name of the argument, for the message.
      core: its last axes, as for `leading_shape`; fewer axes are rejected.
      between: smallest and greatest value allowed; checked if values are concrete.

    Raises:
      InputError: another dtype, too few axes, a value out of range.
    """
    array = as_array(name, value)
    if not np.issubdtype(array.dtype, np.integer):
        raise InputError(f"must be integers {shape_text(core)}, not {described(array)}", field=name)
    _check_rank(name, array, core)
    if between is not None and array.size and is_concrete(array):
        low, high = bounds(array)
        if low < between[0] or high > between[1]:
            bad = low if low < between[0] else high
            raise InputError(f"must be from {between[0]} to {between[1]}", field=name, value=bad)
    return array


def reals(name: str, value: Any, core: str = "") -> np.ndarray | jax.Array:
    """An array of real numbers as float32 (a NumPy or a JAX array), checked like `integers`."""
    array = as_array(name, value)
    if not np.issubdtype(array.dtype, np.floating) and not np.issubdtype(array.dtype, np.integer):
        raise InputError(f"must be real numbers {shape_text(core)}, not {described(array)}", field=name)
    _check_rank(name, array, core)
    with np.errstate(over="ignore"):  # values too large for a float32 become infinite
        return array if array.dtype == np.float32 else array.astype(np.float32)


def flags(name: str, value: Any, core: str = "") -> np.ndarray | jax.Array:
    """An array of booleans, checked like `integers`."""
    array = as_array(name, value)
    if array.dtype != np.bool_:
        raise InputError(f"must be true or false {shape_text(core)}, not {described(array)}", field=name)
    _check_rank(name, array, core)
    return array


def bounds(array: np.ndarray | jax.Array) -> tuple[int, int]:
    """Smallest and greatest element of a concrete array that is not empty."""
    on_host = isinstance(array, np.ndarray) or all(device.platform == "cpu" for device in array.devices())
    array = np.asarray(array) if on_host else array
    return int(array.min()), int(array.max())


def finite(name: str, value: Any, least: float = -np.inf, greatest: float = np.inf) -> None:
    """Check that all numbers of an array are finite and within limits, if its values are concrete.

    Raises:
      InputError: names the first number that is not.
    """
    array = as_array(name, value)
    if not is_concrete(array) or not array.size:
        return
    numbers = np.asarray(array, np.float64)
    good = np.isfinite(numbers) & (numbers >= least) & (numbers <= greatest)
    if not good.all():
        limits = f", {least:g} or more" if least > -np.inf else ""
        limits += f", {greatest:g} or less" if greatest < np.inf else ""
        raise InputError(f"must be finite{limits}", field=name, value=float(numbers[~good][0]))


def cells(name: str, value: Any) -> np.ndarray | jax.Array:
    """Rows and columns [..., 2] as int32. Values that do not fit are outside any grid, and stay outside."""
    array = integers(name, value, "2")
    leading_shape(**{name: (array, "2")})
    return narrowed(array, np.int32)


def narrowed(array: np.ndarray | jax.Array, dtype: type, low: int | None = None, high: int | None = None):
    """Integers as `dtype`, clipped to `low` and `high`, by default the range of the dtype."""
    if array.dtype == dtype and low is None and high is None:
        return array
    held, wanted = np.iinfo(array.dtype), np.iinfo(dtype)
    low = max(held.min, wanted.min if low is None else low)
    high = min(held.max, wanted.max if high is None else high)
    clipped = array.clip(low, high).astype(dtype)
    return np.asarray(clipped) if isinstance(array, np.ndarray) else clipped  # NumPy makes a scalar of a 0-d array


def leading_shape(**arguments: tuple[np.ndarray | jax.Array, str]) -> tuple[int, ...]:
    """The common shape of the leading axes of some arrays, broadcast as NumPy does.

    Args:
      arguments: for each, an array and its last axes, such as "H W" or "8 H W" or "": a number is a size, a letter is a
        size that is the same in all arguments.

    Raises:
      InputError: axes that differ, or that do not broadcast.
    """
    sizes: dict[str, tuple[int, str]] = {}
    leading = {}
    for name, (array, core) in arguments.items():
        _check_rank(name, array, core)
        axes = core.split()
        split = array.ndim - len(axes)
        for axis, size in zip(axes, array.shape[split:], strict=True):
            wanted, origin = (int(axis), "") if axis.isdigit() else sizes.setdefault(axis, (size, name))
            if size != wanted:
                where = f" with {axis} = {wanted} as {origin} has" if origin else ""
                raise InputError(f"must be {shape_text(core)}{where}, not {shape_of(array)}", field=name)
        leading[name] = tuple(array.shape[:split])
    try:
        return np.broadcast_shapes(*leading.values())
    except ValueError:
        given = ", ".join(f"{name} {list(shape)}" for name, shape in leading.items() if shape)
        raise InputError(f"leading axes must broadcast, these do not: {given}") from None


def described(array: np.ndarray | jax.Array) -> str:
    """Dtype and shape, for messages."""
    return f"{array.dtype.name} {shape_of(array)}"


def shape_of(array: np.ndarray | jax.Array) -> str:
    """Shape, for messages."""
    return f"[{', '.join(map(str, array.shape))}]"


def shape_text(core: str) -> str:
    """The last axes of an argument, for messages: "[..., H, W]"."""
    return f"[{', '.join(['...', *core.split()])}]"


def _check_rank(name: str, array: np.ndarray | jax.Array, core: str) -> None:
    if array.ndim < len(core.split()):
        raise InputError(f"must be {shape_text(core)}, not {shape_of(array)}", field=name)


def whole_number(name: str, value: Any, least: int = 0) -> int:
    """A static argument that must be an integer, `least` or more.

    Raises:
      InputError: anything else, including a traced number.
    """
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        shown = value if isinstance(value, (int, float, str)) else type(value).__name__
        raise InputError(f"must be an integer, {least} or more", field=name, value=shown)
    return int(value)
