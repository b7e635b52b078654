"""Searching for costs: the gradient of an objective that is only known by trying, and points spread over a box.

An objective of missions is a function of the paths taken, and these are the same for costs that differ by little: it is
piecewise constant in the costs, and has no gradient to follow. What has one is its mean over perturbed costs,
J_s(t) = E[J(t + s e)], e ~ N(0, 1): grad J_s(t) = E[J(t + s e) e] / s, the score function estimator (evolution
strategies). Perturbations come in pairs +e and -e, which takes out J(t) itself, along directions square to each other,
which spreads them; all are tried on the same arenas with the same noise.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.stats import qmc


def directions(rng: np.random.Generator, pairs: int, dimensions: int) -> Float[np.ndarray, "pairs dimensions"]:
    """Standard normal vectors, square to each other in groups of `dimensions`. Consumes `rng`."""
    groups = -(-pairs // dimensions)
    square, _ = np.linalg.qr(rng.normal(size=(groups, dimensions, dimensions)))
    # QR fixes signs; lengths of normal vectors are drawn apart from their directions
    signs = rng.choice([-1.0, 1.0], size=(groups, dimensions, 1))
    lengths = np.sqrt(rng.chisquare(dimensions, size=(groups, dimensions, 1)))
    return (np.swapaxes(square, 1, 2) * signs * lengths).reshape(-1, dimensions)[:pairs]


def gradient(
    plus: Float[np.ndarray, "pairs"],
    minus: Float[np.ndarray, "pairs"],
    along: Float[np.ndarray, "pairs dimensions"],
    spread: float,
) -> Float[np.ndarray, "dimensions"]:
    """The estimate of grad J_s from the objective at +e and -e; without bias if `along` is standard normal."""
    return ((plus - minus)[:, None] * along).mean(0) / (2 * spread)


def sobol(count: int, low: float, high: float, dimensions: int, seed: int) -> Float[np.ndarray, "count dimensions"]:
    """Points of a scrambled Sobol sequence that fill [low, high] in all dimensions."""
    power = max(count - 1, 0).bit_length()  # whole powers of two are balanced; the first ones of them are taken
    return low + (high - low) * qmc.Sobol(dimensions, rng=seed).random_base2(power)[:count]
