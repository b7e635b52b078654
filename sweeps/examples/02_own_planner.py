"""A planner of your own, by edge costs in JAX, against ours: 02_own_planner.py [ARENAS]"""

import sys
from dataclasses import dataclass

import jax
import jax.numpy as jnp

import jaxbiped as jb


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Shy(jb.GridPlanner):
    fear: float = 3.0  # what a move into a cell beside an obstacle costs more

    def edge_costs(self, problem):
        solid = jnp.pad(problem.classes == jb.Cell.OBSTACLE, 2)
        near = sum(jnp.roll(solid, move, (0, 1)) for move in jb.DIRECTIONS) > 0
        into = jnp.stack([jnp.roll(near, -move, (0, 1))[2:-2, 2:-2] for move in jb.DIRECTIONS])
        return super().edge_costs(problem) + self.fear * into


count = int(sys.argv[1]) if len(sys.argv) > 1 else 200
study = jb.Study(jb.RandomArenas(count=count), ["full", Shy()])
print(jb.evaluate(study).compare("Shy", "full"))
