"""Odometry drift: against plain NumPy, and the stated deviations."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped.sensing import OdometryConfig, drift
from tests.reference import sensing as reference
from tests.sensing.scenes import as_numpy

NOISE = OdometryConfig().traced()
SEEDS = np.arange(2000, dtype=np.uint32)
drifts = jax.jit(jax.vmap(drift, in_axes=(None, None, 0)))


def displacement(*values):
    return tuple(jnp.float32(value) for value in values)


def test_agrees_with_plain_numpy():
    moved, variances = drifts(displacement(0.05, -0.01, 0.3), NOISE, SEEDS[:5])
    for k in range(5):
        expected, spread = reference.drift((0.05, -0.01, 0.3), as_numpy(NOISE), SEEDS[k])
        assert np.allclose([axis[k] for axis in moved], expected, atol=1e-6)
        assert np.allclose(variances[k], spread, rtol=1e-5)


def test_errors_have_the_stated_deviation():
    """2,000 draws: within 8 %, five standard errors."""
    moved, variances = drifts(displacement(0.5, 0, 0), NOISE, SEEDS)
    deviations = np.std(moved, axis=1)
    assert np.allclose(deviations, np.sqrt(variances[0]), rtol=0.08)
    # Ten straight steps of 5 cm: simulated bipeds ended 1.9 degrees off.
    assert abs(np.rad2deg(deviations[2]) - 1.9) < 0.2


def test_ten_steps_drift_like_one_of_ten_times_the_length():
    _, once = drifts(displacement(0.5, 0, 0), NOISE, SEEDS[:1])
    _, step = drifts(displacement(0.05, 0, 0), NOISE, SEEDS[:1])
    assert np.allclose(once, 10 * step, rtol=1e-5)


def test_no_motion_no_error():
    moved, variances = drifts(displacement(0, 0, 0), NOISE, SEEDS[:3])
    assert np.all(np.asarray(moved) == 0) and np.all(np.asarray(variances) == 0)


def test_turning_costs_yaw_only():
    _, variances = drifts(displacement(0, 0, -np.pi / 4), NOISE, SEEDS[:1])
    assert np.all(variances[0, :2] == 0) and variances[0, 2] > 0
