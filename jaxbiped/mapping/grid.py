"""The layout of a grid map, and the body that it is read for."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.core import checks
from jaxbiped.core.class_grid import MOST_CELLS
from jaxbiped.core.class_grid import Cell as Cell
from jaxbiped.errors import InputError

EXACT = 2**24  # integers up to here are float32 numbers
MOST_GROUNDS = 24  # ground levels: 32 fit a mask, and above the highest there is room for a step, and more


@dataclass(frozen=True)
class GridSpec:
    """Layout of the 3D and the 2D grid; static, since it sets array shapes.

    Row i is along y and column j along x; cell (0, 0) has its outer corner at the world's origin. Level l
    holds heights of [l - 1/2, l + 1/2) level heights, so that level 0 is the base floor with its noise; voxel
    index k is level k + `lowest`.

    Raises:
      InputError: a field of another type, the pitch does not divide the area, a column does not fit a 32-bit mask, or
        there is no room for the ground.
    """

    size_x: float = 1.80  # [m]
    size_y: float = 1.40  # [m]
    pitch: float = 0.05  # [m]
    level_height: float = 0.03  # [m]
    lowest: int = -1  # level of voxel 0; levels below 0 are noise of the base floor
    levels: int = 16  # Z, number of voxel levels
    ground_levels: int = 3  # levels that a robot may stand on: 0 (floor), 1 and 2 (bumps of 3 and 6 cm)
    max_radius: float = 0.15  # [m] largest radius of a body that this grid is read for

    def __post_init__(self):
        for field in fields(self):
            value, whole = getattr(self, field.name), isinstance(field.default, int)
            kinds = (int, np.integer) if whole else (int, float, np.integer, np.floating)
            if isinstance(value, bool) or not isinstance(value, kinds):
                shown = value if isinstance(value, (bool, float, str)) else type(value).__name__
                raise InputError(f"must be {'an integer' if whole else 'a number'}", field=field.name, value=shown)
        for name in ("size_x", "size_y"):
            size = getattr(self, name)
            cells = size / self.pitch if self.pitch > 0 else math.nan
            if not (0.5 < cells < math.inf) or abs(cells - round(cells)) > 1e-6 * cells:
                raise InputError(f"must divide the area's {name} of {size:g} m", field="pitch", value=self.pitch)
        allowed = {
            "lowest": (-8 <= self.lowest <= 0, "from -8 to 0"),
            "ground_levels": (1 <= self.ground_levels <= MOST_GROUNDS, f"from 1 to {MOST_GROUNDS}"),
            "levels": (
                self.ground_levels < self.levels + self.lowest <= 32,
                "at most 32 from level 0 up, and more than ground_levels",
            ),
            "level_height": (0 < self.level_height < math.inf, "above 0"),
            "max_radius": (0 <= self.max_radius <= 64 * self.pitch, "from 0 to 64 cells"),
        }
        for name, (good, what) in allowed.items():
            if not good:
                raise InputError(f"must be {what}", field=name, value=getattr(self, name))
        if self.shape[0] * self.shape[1] > MOST_CELLS:
            area = f"{self.size_x:g} x {self.size_y:g} m"
            raise InputError(f"must give at most {MOST_CELLS} cells on {area}", field="pitch", value=self.pitch)

    @property
    def shape(self) -> tuple[int, int]:
        """(H, W)."""
        return round(self.size_y / self.pitch), round(self.size_x / self.pitch)

    @property
    def axis_sizes(self) -> dict[str, int]:
        """Sizes of the axes of what lies on this grid, by their letters."""
        return {"H": self.shape[0], "W": self.shape[1], "Z": self.levels, "G": self.ground_levels}

    def ground_heights(self) -> Float[np.ndarray, "G"]:
        """Height [m] of each ground level, float32."""
        return np.arange(self.ground_levels, dtype=np.float32) * np.float32(self.level_height)

    @property
    def cell_share(self) -> float:
        """A cell's area as a share of 5 x 5 cm, the cell that thresholds on numbers of points are stated for."""
        return (self.pitch / 0.05) ** 2

    @property
    def patch_aside(self) -> int:
        """How many cells on each side of a cell make up the patch of about 5 x 5 cm around it."""
        return int(0.025 / self.pitch + 1e-6)

    @property
    def beside(self) -> int:
        """How many cells next to a cell make up 5 cm; at least one."""
        return max(round(0.05 / self.pitch), 1)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Body:
    """The robot as the map sees it: an upright cylinder with two heights (paper, 2.2, Fig. 4). All traced."""

    radius: Float[Array, "*B"]  # [m] of the C-obstacle cylinder
    standing: Float[Array, "*B"]  # [m] head height, standing
    squatting: Float[Array, "*B"]  # [m] head height, squatting
    step: Float[Array, "*B"]  # [m] greatest height of one step up or down
    step_tolerance: Float[Array, "*B"]  # [m] what is higher than a step by more is touched
    height_tolerance: Float[Array, "*B"]  # [m] the ground may be off the height stepped to


def check_body(body: Body, spec: GridSpec) -> None:
    """Check the numbers of a body, where they are concrete, against a grid that is read for it.

    Raises:
      InputError: a number below 0 or not finite, or a radius beyond `GridSpec.max_radius`.
    """
    checks.finite("body.radius", body.radius, 0.0, spec.max_radius * (1 + 1e-6))  # as a float32 it may be rounded up
    for name in ("standing", "squatting", "step", "step_tolerance", "height_tolerance"):
        checks.finite(f"body.{name}", getattr(body, name), 0.0)


def flat_index(
    inside: Bool[Array, "*S"], places: tuple[Float[Array, "*S"], ...], sizes: tuple[int, ...]
) -> Int[Array, "*S"]:
    """Index [int32] into a flattened array of places along its axes (whole numbers); 0 for those not `inside`.

    In float32 where all indices are exact there, which costs one conversion; else by integers.
    """
    if math.prod(sizes) > EXACT:
        places = tuple(jnp.where(inside, place, 0.0).astype(jnp.int32) for place in places)
    index = places[0]
    for place, size in zip(places[1:], sizes[1:], strict=True):
        index = index * size + place
    return jnp.where(inside, index, 0).astype(jnp.int32)


def patch_sum(planes: Float[Array, "K H W"], spec: GridSpec) -> Float[Array, "K H W"]:
    """Sums over the patch of about 5 x 5 cm around each cell, at least its own; beyond the rim there is nothing."""
    aside = spec.patch_aside
    if not aside:
        return planes
    height, width = planes.shape[1:]
    padded = jnp.pad(planes, ((0, 0), (aside, aside), (aside, aside)))
    rows = sum(padded[:, i : i + height] for i in range(2 * aside + 1))
    return sum(rows[..., j : j + width] for j in range(2 * aside + 1))
