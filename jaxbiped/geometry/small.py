"""Matrices of a few elements, for functions that are mapped over thousands of arenas."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float


def matrix(rows: tuple[tuple[Float[Array, ""], ...], ...]) -> Float[Array, "rows columns"]:
    """A matrix from its elements."""
    return jnp.stack([jnp.stack(row) for row in rows])


def product(a: Float[Array, "m k"], b: Float[Array, "k n"]) -> Float[Array, "m n"]:
    """Matrix product in full float32 on any device, as sums: many tiny products are slow as library calls."""
    return jnp.sum(a[:, :, None] * b[None, :, :], axis=1)
