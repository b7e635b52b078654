"""What a study may fix of the random arenas, which is drawn otherwise. Light to import, without JAX."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import TYPE_CHECKING, Annotated

import pydantic

from jaxbiped.config import Model

if TYPE_CHECKING:
    from jaxbiped.arenas.population import Population

# The family that each field is about.
FAMILY_OF = {"bump_width": "bump", "bump_length": "bump", "bump_height": "bump", "obstacle_speed": "traffic"}


class PopulationConfig(Model):
    """Measures of the boxes of a family that are the same in all of its arenas. What is not given is drawn."""

    bump_width: Annotated[float, pydantic.Field(gt=0.0, le=0.6)] | None = None
    """[m] of the bar of the family `bump` along the way: how far one walks on it. Drawn from 0.15 to 0.45."""
    bump_length: Annotated[float, pydantic.Field(gt=0.0, le=1.4)] | None = None
    """[m] of that bar across the way, which makes the detour round it. Drawn from 0.24 to 1.4, longer where harder."""
    bump_height: Annotated[float, pydantic.Field(gt=0.0, le=0.5)] | None = None
    """[m] of that bar. 0.03, one step of the robot, where it is not given."""
    obstacle_speed: Annotated[float, pydantic.Field(ge=0.0, le=1.0)] | None = None
    """[m/s] of the blocks of the family `traffic`. Drawn from 0 to 0.02."""

    def traced(self) -> Population:
        """The same as arrays; NaN: drawn."""
        import jax.numpy as jnp

        from jaxbiped.arenas.population import Population

        given = {field.name: getattr(self, field.name) for field in fields(Population)}
        return Population(**{name: jnp.float32(math.nan if value is None else value) for name, value in given.items()})
