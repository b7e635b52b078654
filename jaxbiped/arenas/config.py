"""Measures of random arenas that a study may fix instead of drawing them. Quick to import, without JAX."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import TYPE_CHECKING, Annotated

import pydantic

from jaxbiped.config import Model

if TYPE_CHECKING:
    from jaxbiped.arenas.population import Population

# The family to which each field applies.
FAMILY_OF = {"bump_width": "bump", "bump_length": "bump", "bump_height": "bump", "obstacle_speed": "traffic"}


class PopulationConfig(Model):
    """Measures of the boxes of a family that are the same in all of its arenas. Measures not given are drawn."""

    bump_width: Annotated[float, pydantic.Field(gt=0.0, le=0.6)] | None = None
    """[m] Length of the bar of the family `bump` along the path: how far one walks on it. Drawn from 0.15 to 0.45."""
    bump_length: Annotated[float, pydantic.Field(gt=0.0, le=1.4)] | None = None
    """[m] Length of that bar across the path, which makes the detour. Drawn from 0.24 to 1.4, longer where harder."""
    bump_height: Annotated[float, pydantic.Field(gt=0.0, le=0.5)] | None = None
    """[m] Height of that bar. By default 0.03, one step of the robot."""
    obstacle_speed: Annotated[float, pydantic.Field(ge=0.0, le=1.0)] | None = None
    """[m/s] Speed of the blocks of the family `traffic`. Drawn from 0 to 0.02."""

    def traced(self) -> Population:
        """The measures as arrays; NaN: drawn."""
        import jax.numpy as jnp

        from jaxbiped.arenas.population import Population

        given = {field.name: getattr(self, field.name) for field in fields(Population)}
        return Population(**{name: jnp.float32(math.nan if value is None else value) for name, value in given.items()})
