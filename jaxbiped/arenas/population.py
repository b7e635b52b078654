"""What a study may fix of the random arenas, which is drawn otherwise."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


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
