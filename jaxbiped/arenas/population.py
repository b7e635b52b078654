"""Measures of random arenas that a study may fix instead of drawing them."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Population:
    """`PopulationConfig`, traced. Same units; NaN for drawn values."""

    bump_width: Float[Array, "*B"]
    bump_length: Float[Array, "*B"]
    bump_height: Float[Array, "*B"]
    obstacle_speed: Float[Array, "*B"]


def given_or(fixed: Float[Array, ""], drawn: Float[Array, "*S"]) -> Float[Array, "*S"]:
    """The fixed value if there is one, else the drawn one."""
    return jnp.where(jnp.isnan(fixed), drawn, fixed)
