"""A sensor of your own, ours with a shorter reach that is swept: 08_own_sensor.py [ARENAS]"""

import sys
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp

import jaxbiped as jb


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class ShortSighted(jb.RayCast):
    reach: float = 1.0  # [m]

    def measure(self, arena, at, params, spec):
        view = super().measure(arena, at, params, spec)
        return replace(view, weight=jnp.where(jnp.hypot(view.x, view.y) < self.reach, view.weight, 0.0))


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    study = jb.Study(jb.RandomArenas(count=count), ["full"], sensor=ShortSighted())
    results = jb.sweep(study, {"sensor.reach": [0.4, 0.7, 1.5]})
    print(results)
    results.plot("time").savefig("reach.png")
