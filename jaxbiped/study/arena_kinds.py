"""Families of a study whose arenas are of one kind (size and terrain), and so share compiled programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Int

from jaxbiped.arenas.families import SIZE_X, SIZE_Y
from jaxbiped.arenas.source import OwnFamily, size_of, terrain_of
from jaxbiped.core.names import FAMILIES
from jaxbiped.geometry.height_field import HeightField


@dataclass(frozen=True)
class ArenaKind:
    """Families whose arenas are of one kind. Arena k of a study is of family k modulo their number."""

    families: tuple[str | OwnFamily, ...]  # those of this kind
    places: tuple[int, ...]  # positions of these among all families of the study, ascending
    number: int  # number of all families
    size_xy: tuple[float, float] = (SIZE_X, SIZE_Y)  # [m]
    terrain: HeightField | None = field(default=None, repr=False, compare=False)

    def slots(self, size: int) -> int:
        """The largest number of arenas of this kind in a block of `size` arenas."""
        return size if len(self.places) == self.number else -(-size // self.number) * len(self.places)

    def indices(self, first: int, size: int) -> Int[np.ndarray, "slots"]:
        """Numbers of the arenas of this kind from `first` on, ascending: as many as a block of `size` may have.

        Those beyond the block make all blocks equally long, so that they share one program.
        """
        beyond = np.arange(first, first + size + 2 * self.number)
        return beyond[np.isin(beyond % self.number, self.places)][: self.slots(size)]

    def count(self, first: int, count: int) -> int:
        """How many of the `count` arenas from `first` on are of this kind."""
        return int(np.isin(np.arange(first, first + count) % self.number, self.places).sum())

    def turns(self, index: Int[np.ndarray, "A"]) -> Int[np.ndarray, "A"]:
        """The position in `families` of the family of each of these arenas."""
        return np.searchsorted(self.places, index % self.number)


ANY = ArenaKind(FAMILIES, tuple(range(len(FAMILIES))), len(FAMILIES))


def kinds_of(families: Sequence[str | OwnFamily]) -> tuple[ArenaKind, ...]:
    """The kinds of a study's families, in order of their first occurrence."""
    together: dict[tuple, list[int]] = {}
    for place, family in enumerate(families):
        terrain = terrain_of(family)
        together.setdefault((size_of(family), place if terrain is not None else None), []).append(place)
    found = []
    for (size, _), places in together.items():
        own = tuple(families[k] for k in places)
        found.append(ArenaKind(own, tuple(places), len(families), size, terrain_of(own[0])))
    return tuple(found)
