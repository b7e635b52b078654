"""Search for costs: the gradient of an objective that is known only by trial, and points spread over a box.

An objective of missions is a function of the paths taken, and these are the same for costs that differ by little: it is
piecewise constant in the costs, and has no gradient to follow. Its mean over a ball of perturbed costs has one,
J_r(t) = E[J(t + r v)], v uniform in the unit ball of d dimensions: grad J_r(t) = d/r E[J(t + r u) u], u uniform on the
sphere (Flaxman, Kalai and McMahan, 2005, Online convex optimization in the bandit setting). Directions are orthogonal
and come in pairs +u and -u: d pairs are central differences with a wide step along a randomly rotated frame, and exact
where J is linear. All are tried on the same arenas with the same noise.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.stats import qmc


def directions(rng: np.random.Generator, pairs: int, dimensions: int) -> Float[np.ndarray, "pairs dimensions"]:
    """Unit vectors, each uniform on the sphere, orthogonal in groups of `dimensions`. Consumes `rng`."""
    groups = -(-pairs // dimensions)
    square, _ = np.linalg.qr(rng.normal(size=(groups, dimensions, dimensions)))
    signs = rng.choice([-1.0, 1.0], size=(groups, dimensions, 1))  # QR is biased
    return (np.swapaxes(square, 1, 2) * signs).reshape(-1, dimensions)[:pairs]


def gradient(
    plus: Float[np.ndarray, "pairs"],
    minus: Float[np.ndarray, "pairs"],
    along: Float[np.ndarray, "pairs dimensions"],
    radius: float,
) -> Float[np.ndarray, "dimensions"]:
    """The unbiased estimate of grad J_r, from the objective at t + r u (`plus`) and at t - r u (`minus`)."""
    pairs, dimensions = along.shape
    return dimensions / pairs * ((plus - minus) / (2 * radius)) @ along


def sobol(count: int, low: float, high: float, dimensions: int, seed: int) -> Float[np.ndarray, "count dimensions"]:
    """Points of a scrambled Sobol sequence that fill [low, high] in all dimensions."""
    power = max(count - 1, 0).bit_length()  # whole powers of two are balanced; the first `count` are used
    return low + (high - low) * qmc.Sobol(dimensions, rng=seed).random_base2(power)[:count]
