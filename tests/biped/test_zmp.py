"""The pendulum against SciPy's banded solver and against its own equation."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

from jaxbiped.biped.config import GRAVITY
from jaxbiped.biped.zmp import com_from_zmp, zmp_of_masses

N = 200
SOLVE = jax.jit(com_from_zmp)
ROUND = 2e-5  # [m] single precision, where z/g/dt^2 = 5000 scales it


def reference(zmp, height, dt):
    ratio = height / (GRAVITY * dt**2)
    banded = np.zeros((3, len(zmp)))
    banded[0, 2:], banded[2, :-2] = -ratio, -ratio
    banded[1, 1:-1], banded[1, [0, -1]] = 1 + 2 * ratio, 1.0
    return scipy.linalg.solve_banded((1, 1), banded, zmp)


@pytest.mark.parametrize("dt", [0.002, 0.02, 0.2])
def test_against_scipy(dt):
    zmp = np.cumsum(np.random.default_rng(0).normal(0, 0.003, (N, 2)), axis=0)
    np.testing.assert_allclose(SOLVE(zmp, 0.2, dt), reference(zmp, 0.2, dt), atol=ROUND)


def test_a_slow_reference_is_followed_and_rests_at_both_ends():
    zmp = np.repeat([[0.0, 0.0], [0.03, 0.05], [0.0, 0.0]], [60, 80, 60], axis=0)
    com = np.asarray(SOLVE(zmp, 0.2, 0.05))
    np.testing.assert_allclose(com[100], [0.03, 0.05], atol=1e-5)
    np.testing.assert_allclose(np.diff(com, axis=0)[[0, -1]], 0.0, atol=1e-6)


def test_the_zero_moment_point_of_one_mass_is_the_pendulums_reference():
    s = np.clip(np.linspace(-0.5, 1.5, N), 0, 1)
    zmp = np.stack([0.05 * s**3 * (10 - 15 * s + 6 * s**2), np.zeros(N)], axis=1)
    com = SOLVE(zmp, 0.2, 0.01)
    points = jnp.concatenate([com, jnp.full((N, 1), 0.25)], axis=1)[:, None]
    found = zmp_of_masses(points, jnp.array([2.5]), jnp.full(N, 0.05), 0.01)
    # Second differences of single precision: 6e-8 * 0.05 m / (0.01 s)^2 * z / g.
    np.testing.assert_allclose(found, zmp, atol=2e-5)
