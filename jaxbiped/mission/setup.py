"""What does not change during a mission: the arena, the numbers, and what its program is compiled for."""

from __future__ import annotations

from dataclasses import dataclass, field

import jax

from jaxbiped.arenas.arena import Arena
from jaxbiped.mission.params import MissionParams, MissionSpec


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class MissionSetup:
    """One mission, or a batch of them: then arena and params have the same leading axis, and the spec is common."""

    arena: Arena  # true; the robot reads its landmarks and its goal alone
    params: MissionParams
    spec: MissionSpec = field(metadata={"static": True})
