"""The built-in executors, which play a command in the true world.

`kinematic` moves exactly as the primitives say; `sampled` moves as simulated bipeds were measured to; simulated bipeds
are driven from the host (`mission.simulated_driver`). Users may add more (`execution.Executor`).
"""

from __future__ import annotations

from dataclasses import dataclass

import jax

from jaxbiped.arenas.arena import Arena
from jaxbiped.core.registry import EXECUTORS
from jaxbiped.executors.execution import Execution, Executor
from jaxbiped.executors.kinematic_executor import kinematic
from jaxbiped.executors.params import ExecutorParams
from jaxbiped.executors.sampled_executor import sampled
from jaxbiped.executors.world_state import WorldState
from jaxbiped.motion.primitives import Command


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Kinematic(Executor):
    """Moves exactly as the primitives say; see `kinematic`."""

    on_terrain = True

    def execute(self, arena: Arena, world: WorldState, command: Command, params: ExecutorParams) -> Execution:
        """See `Executor`."""
        return kinematic(arena, world, command, params)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Sampled(Executor):
    """Moves as simulated bipeds were measured to; see `sampled`."""

    places_feet, on_terrain = True, True

    def execute(self, arena: Arena, world: WorldState, command: Command, params: ExecutorParams) -> Execution:
        """See `Executor`."""
        return sampled(arena, world, command, params)


BUILT_IN = {"kinematic": Kinematic(), "sampled": Sampled()}
for _name, _executor in BUILT_IN.items():
    EXECUTORS.add(_name, _executor)
