"""An executor of your own, feet that slip now and then: 09_own_executor.py [ARENAS]"""

import sys
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp

import jaxbiped as jb


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Slippery(jb.Kinematic):
    chance: float = 0.05  # of a fall, in a step up or down

    def execute(self, arena, world, command, params):
        done = super().execute(arena, world, command, params)
        key = jax.random.fold_in(jax.random.key(world.seed), world.decisions)
        slips = (command.rise != 0) & (jax.random.uniform(key) < self.chance)
        return replace(done, fell=done.fell | (slips & ~done.collided), time=jnp.where(slips, 0.0, done.time))


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    study = jb.Study(jb.RandomArenas(["bump", "stairs"], count=count), ["full", "floor_only"], executor=Slippery())
    print(jb.sweep(study, {"executor.chance": [0.0, 0.1, 0.3]}))
