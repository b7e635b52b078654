"""Arguments of the planning functions: checked, broadcast, and with one batch axis."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped.core.batching import fold
from jaxbiped.core.checks import bounds, cells, flags, integers, is_concrete, leading_shape, narrowed, reals
from jaxbiped.errors import InputError
from jaxbiped.mapping.grid import Cell

LEVELS = np.iinfo(np.int8)
CODES = ", ".join(f"{cell.value} {cell.name.lower()}" for cell in Cell)


def grid_arguments(
    classes: Any, levels: Any, *parts: Any, arrays: dict[str, tuple[Any, str]] | None = None, **points: Any
) -> tuple[tuple[int, ...], tuple]:
    """Class grids with their costs, rules and further arguments.

    Args:
      classes, levels: as for `planning.field`.
      parts: dataclasses of numbers or of booleans, one per arena or one for all: `Costs`, `Rules`, `Times`.
      arrays: further arrays to check, by name, with their last axes as in `checks.leading_shape`.
      points: further integer arrays by name: `...ij` are cells [..., 2], others one direction per arena.

    Returns:
      The batch shape, and (classes, levels, *parts, *arrays, *points), all with one leading axis: classes and levels
      int8 [N, H, W], where an invalid cell of a traced grid has a class of its own (`INVALID`); float32, bool or int32
      [N].

    Raises:
      InputError: a rank, shape, dtype, class code or level that is not allowed.
    """
    classes, levels = class_grids(classes, levels)
    given: dict[str, tuple[Any, str]] = {"classes": (classes, "H W"), "levels": (levels, "H W")}
    checked_parts = [checked_fields(part) for part in parts]
    for part in checked_parts:
        name = type(part).__name__.lower()
        given |= {f"{name}.{field.name}": (getattr(part, field.name), "") for field in fields(part)}
    given |= arrays or {}
    for name, value in points.items():
        given[name] = (cells(name, value), "2") if name.endswith("ij") else (indices(name, value), "")
    batch = leading_shape(**given)
    folded_parts = (jax.tree.map(lambda leaf: fold(leaf, batch, 0), part) for part in checked_parts)
    folded = (fold(given[name][0], batch, len(given[name][1].split())) for name in (*(arrays or {}), *points))
    return batch, (fold(classes, batch, 2), fold(levels, batch, 2), *folded_parts, *folded)


INVALID = 5  # the class of invalid cells: impassable, and a field of such a map does not converge


def class_grids(classes: Any, levels: Any) -> tuple[np.ndarray | jax.Array, np.ndarray | jax.Array]:
    """Classes and levels as int8.

    The level of an obstacle or an unmeasured cell is not read, so it may be anything.

    Raises:
      InputError: not integers, or too few axes; for concrete grids also a class that is not a `Cell`, or a level
        beyond int8.
    """
    classes = integers("classes", classes, "H W")
    levels = integers("levels", levels, "H W")
    if classes.size and is_concrete(classes):
        low, high = bounds(classes)
        if low < 0 or high >= len(Cell):
            raise InputError(f"must be one of {CODES}", field="classes", value=low if low < 0 else high)
    if levels.dtype != np.int8:
        leading_shape(classes=(classes, "H W"), levels=(levels, "H W"))
        numpy = np if isinstance(levels, np.ndarray) and isinstance(classes, np.ndarray) else jnp
        read = (classes != Cell.OBSTACLE) & (classes != Cell.UNMEASURED)
        levels = numpy.where(read, levels, 0)
        fits = (levels >= LEVELS.min) & (levels <= LEVELS.max)
        if not is_concrete(levels):
            classes = jnp.where(fits, classes, INVALID)
        elif not fits.all():
            bad = int(levels[tuple(np.argwhere(np.asarray(~fits))[0])])
            raise InputError(f"must be from {LEVELS.min} to {LEVELS.max}", field="levels", value=bad)
        levels = narrowed(levels, np.int8)
    if classes.dtype != np.int8:
        classes = narrowed(classes, np.int8, -1, INVALID)
    return classes, levels


def are_classes(classes: jax.Array) -> jax.Array:
    """Bool [N]: whether all cells of each grid [N, H, W] have a class."""
    return ((classes >= 0) & (classes < len(Cell))).all((1, 2))


def checked_fields(part: Any):
    """A dataclass of numbers or booleans with its leaves checked: float32 or bool arrays.

    The defaults of its class tell which of the two they are.
    """
    name, default = type(part).__name__.lower(), type(part)()

    def leaf(field):
        check = flags if isinstance(getattr(default, field.name), bool) else reals
        return check(f"{name}.{field.name}", getattr(part, field.name))

    return type(part)(**{field.name: leaf(field) for field in fields(part)})


def indices(name: str, value: Any) -> np.ndarray | jax.Array:
    """Directions [...], -1 for none, as int32."""
    return narrowed(integers(name, value, between=(-1, 7)), np.int32, -1, 7)
