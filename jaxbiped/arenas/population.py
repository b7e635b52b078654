"""What a study may fix of the random arenas, which is drawn otherwise."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Annotated

import jax
import jax.numpy as jnp
import pydantic
from jaxtyping import Array, Float

from jaxbiped.config import Model

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
        given = {field.name: getattr(self, field.name) for field in fields(Population)}
        return Population(**{name: jnp.float32(math.nan if value is None else value) for name, value in given.items()})


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Population:
    """`PopulationConfig`, traced. Units as there; NaN where it is drawn."""

    bump_width: Float[Array, "*B"]
    bump_length: Float[Array, "*B"]
    bump_height: Float[Array, "*B"]
    obstacle_speed: Float[Array, "*B"]


def given_or(fixed: Float[Array, ""], drawn: Float[Array, "*S"]) -> Float[Array, "*S"]:
    """What is fixed, or else what was drawn."""
    return jnp.where(jnp.isnan(fixed), drawn, fixed)
