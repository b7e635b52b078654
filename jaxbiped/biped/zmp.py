"""Centre of mass from zero moment point: the linear inverted pendulum, solved as one tridiagonal system."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxbiped.biped.config import GRAVITY


def com_from_zmp(
    zmp: Float[Array, "N 2"], height: Float[Array, ""] | float, dt: Float[Array, ""] | float
) -> Float[Array, "N 2"]:
    """Centre of mass of the pendulum with the given zero moment point: c - (z/g) c'' = p, c = p at both ends.

    Central differences make this a tridiagonal system, diagonally dominant for every `dt`. The solution looks ahead
    by the pendulum's time constant sqrt(z/g), about 0.15 s: where p rests long at both ends, c is at rest there too.

    Args:
      zmp: [m] at times `dt` [s] apart.
      height: [m] height of the centre of mass above the ground, assumed constant.
    """
    ratio = height / (GRAVITY * dt**2)
    inner = jnp.ones(zmp.shape[0]).at[jnp.array([0, -1])].set(0.0)
    off = -ratio * inner
    return jax.lax.linalg.tridiagonal_solve(off, 1.0 + 2.0 * ratio * inner, off, zmp)


def second_difference(values: Float[Array, "N *C"], dt: Float[Array, ""] | float) -> Float[Array, "N *C"]:
    """Acceleration by central differences; zero at both ends, where movements rest."""
    inner = (values[2:] - 2 * values[1:-1] + values[:-2]) / dt**2
    none = jnp.zeros_like(values[:1])
    return jnp.concatenate([none, inner, none])


def zmp_of_masses(
    points: Float[Array, "N L 3"],
    masses: Float[Array, "L"],
    ground: Float[Array, "N"],
    dt: Float[Array, ""] | float,
) -> Float[Array, "N 2"]:
    """Zero moment point [m] of moving point masses, at the height `ground` [m]; spins of the links are neglected."""
    acceleration = second_difference(points, dt)
    weight = masses * (acceleration[..., 2] + GRAVITY)
    arm = points[..., 2] - ground[:, None]
    moment = weight[..., None] * points[..., :2] - (masses * arm)[..., None] * acceleration[..., :2]
    return jnp.sum(moment, axis=1) / jnp.sum(weight, axis=1)[:, None]
