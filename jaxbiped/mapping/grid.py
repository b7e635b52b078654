"""The grid's words: classes of a cell, its layout, and the body that it is read for."""

from __future__ import annotations

import enum
from dataclasses import dataclass

import jax
from jaxtyping import Array, Float

from jaxbiped.errors import InputError


class Cell(enum.IntEnum):
    """Class of a cell of the 2D grid map (paper, 2.2)."""

    UNMEASURED = 0
    FLOOR = 1
    BUMP = 2
    GATE = 3
    OBSTACLE = 4


@dataclass(frozen=True)
class GridSpec:
    """Layout of the 3D and the 2D grid; static, since it sets array shapes.

    Row i is along y and column j along x; cell (0, 0) has its outer corner at the world's origin. Level l
    holds heights of [l - 1/2, l + 1/2) level heights, so that level 0 is the base floor with its noise; voxel
    index k is level k + `lowest`.

    Raises:
      InputError: the pitch does not divide the area.
    """

    size_x: float = 1.80  # [m]
    size_y: float = 1.40  # [m]
    pitch: float = 0.05  # [m]
    level_height: float = 0.03  # [m]
    lowest: int = -1  # level of voxel 0
    levels: int = 16  # Z, number of voxel levels

    def __post_init__(self):
        for name in ("size_x", "size_y"):
            cells = getattr(self, name) / self.pitch
            if round(cells) < 1 or abs(cells - round(cells)) > 1e-6 * max(cells, 1.0):
                raise InputError(
                    f"must divide the area's {name} of {getattr(self, name):g} m", field="pitch", value=self.pitch
                )

    @property
    def shape(self) -> tuple[int, int]:
        """(H, W)."""
        return round(self.size_y / self.pitch), round(self.size_x / self.pitch)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Body:
    """The robot as the map sees it: an upright cylinder with two heights (paper, 2.2, Fig. 4). All traced."""

    radius: Float[Array, "*B"]  # [m] of the C-obstacle cylinder
    standing: Float[Array, "*B"]  # [m] head height, standing
    squatting: Float[Array, "*B"]  # [m] head height, squatting
    step: Float[Array, "*B"]  # [m] greatest height of one step up or down
