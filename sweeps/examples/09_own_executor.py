"""An executor of your own, feet that slip now and then: 09_own_executor.py [ARENAS]"""

import sys
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp

import jaxbiped as jb

SLIP = 100  # channel of a mission's seed, beside those that are in use


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Slippery(jb.Kinematic):
    chance: float = 0.05  # of a fall, in a step up or down

    def execute(self, arena, world, command, settings):
        done = super().execute(arena, world, command, settings)
        drawn = jb.uniform(jb.fold(world.seed, SLIP, world.decisions), 0)
        slips = (command.rise != 0) & (drawn < self.chance)
        return replace(done, fell=done.fell | (slips & ~done.collided), time=jnp.where(slips, 0.0, done.time))


count = int(sys.argv[1]) if len(sys.argv) > 1 else 100
study = jb.Study(jb.RandomArenas(["bump", "stairs"], count=count), ["full", "floor_only"], executor=Slippery())
print(jb.sweep(study, {"executor.chance": [0.0, 0.1, 0.3]}))
