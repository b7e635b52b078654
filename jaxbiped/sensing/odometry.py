"""Drift of dead reckoning: the difference between requested and actual motion.

A random walk: variances grow with the distance walked and the angle turned, so that ten steps of 5 cm drift like one of
50 cm. The paper gives no figures. With the default yaw error, ten simulated straight steps end with a standard
deviation of 1.9 degrees (a single one 0.18 degrees, a step over a bump the same), and thereby about 9 mm to the side;
translation by itself adds 0.1 mm per step in simulation, and is set larger here, since shoes and floors are worse. In
simulation the drift is mostly a steady creep of one sign; here it has mean zero, as if calibrated on average.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, UInt32

from jaxbiped.core.checks import finite
from jaxbiped.core.signatures import checked
from jaxbiped.sensing import counter_rng

ODOMETRY = 5  # channel of a step's seed


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class OdometryNoise:
    """All traced; see `OdometryConfig` for what each is. Angles in radians."""

    forward: Float[Array, "*B"]  # [m / sqrt m]
    lateral: Float[Array, "*B"]  # [m / sqrt m]
    yaw_walked: Float[Array, "*B"]  # [rad / sqrt m]
    yaw_turned: Float[Array, "*B"]  # [rad / sqrt rad]


Displacement = tuple[Float[Array, ""], Float[Array, ""], Float[Array, ""]]


@checked(numbers=("displacement", "noise"))
def drift(
    displacement: Displacement, noise: OdometryNoise, seed: UInt32[Array, ""]
) -> tuple[Displacement, Float[Array, "3"]]:
    """A displacement (dx, dy, dyaw) [m, m, rad] in the robot frame with its error, and the error's variances.

    The result is what odometry counted for a true motion, or the actual motion for an intended one. The error's axes
    are those of the robot frame before the step; without motion there is no error. The variances [m^2, m^2, rad^2] are
    those for `localisation.predict`. The channel ODOMETRY of `seed` is used. Without any motion there is no derivative:
    the error grows with the square root of the distance.

    Raises:
      InputError: an argument of another rank, shape or type, a displacement that is not finite, NaN in `noise`.
    """
    for i, part in enumerate(displacement):
        finite(f"displacement[{i}]", part)
    dx, dy, dyaw = displacement
    walked, turned = jnp.sqrt(dx * dx + dy * dy), jnp.abs(dyaw)
    yaw = noise.yaw_walked * noise.yaw_walked * walked + noise.yaw_turned * noise.yaw_turned * turned
    variances = jnp.stack([noise.forward * noise.forward * walked, noise.lateral * noise.lateral * walked, yaw])
    error = jnp.sqrt(variances) * counter_rng.normal(seed, np.arange(3), ODOMETRY)
    return (dx + error[0], dy + error[1], dyaw + error[2]), variances
