"""A metric of your own, which is a column, and compared and drawn like any other: 07_own_metric.py [ARENAS]"""

import sys
from dataclasses import dataclass

import jax
import jax.numpy as jnp

import jaxbiped as jb


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class TurnedAngle(jb.Metric):
    unit = "rad"

    def start(self, arena, params):
        return jnp.zeros(())

    def update(self, state, step):
        return state + jnp.abs(step.command.turn)

    def result(self, state, end):
        return state, end.result.code == jb.Code.REACHED  # the number, and whether there is one


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    study = jb.Study(jb.RandomArenas(count=count), ["full", "floor_only"], metrics=["spl", TurnedAngle()])
    results = jb.evaluate(study)
    print(results.compare("full", "floor_only"))
    results.plot("turned_angle").savefig("turned_angle.png")
