"""The robot's dimensions, as needed by the map and the referee."""

from __future__ import annotations

from dataclasses import dataclass

import jax
from jaxtyping import Array, Float


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Footing:
    """`FootingConfig`, traced."""

    length: Float[Array, "*B"]
    before_up: Float[Array, "*B"]
    before_down: Float[Array, "*B"]
    tolerance: Float[Array, "*B"]
    clear_up: Float[Array, "*B"]
    clear_down: Float[Array, "*B"]
    foot_length: Float[Array, "*B"]
    hip_offset: Float[Array, "*B"]
    foot_outside: Float[Array, "*B"]
