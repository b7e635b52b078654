"""The missions that a driver plays: some arenas, each under some sweep points."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Array, Int, UInt32

from jaxbiped.arenas.arena import Arena
from jaxbiped.mission.params import MissionParams, MissionSpec
from jaxbiped.mission.setup import MissionSetup


@dataclass(frozen=True)
class Workload:
    """The first `count` arenas under every sweep point; results are [P, count]."""

    arenas: Arena  # [A], or [U * A] where there are `U` populations
    seeds: UInt32[Array, "A"]  # of the missions' noise
    params: MissionParams  # [P], the points
    count: int  # arenas that are played; the others are padding
    spec: MissionSpec
    population_of: Int[np.ndarray, "P"] | None = None  # the population of each point; None: the first

    @property
    def size(self) -> int:
        """Arenas of each population, A."""
        return self.seeds.shape[0]

    @property
    def kinds(self) -> int:
        """Points, P."""
        return jax.tree.leaves(self.params)[0].shape[0]

    @property
    def blocks(self) -> Int[np.ndarray, "P"]:
        """The row of `arenas` where the population of each point begins."""
        return self.size * (np.zeros(self.kinds, int) if self.population_of is None else self.population_of)

    @property
    def setup(self) -> MissionSetup:
        """All arenas and all points, as for `batched_driver.compile_queue`."""
        return MissionSetup(self.arenas, self.params, self.spec)

    def setup_of(self, arena: int, point: int) -> MissionSetup:
        """One mission."""
        rows = (self.arenas, int(self.blocks[point]) + arena), (self.params, point)
        return MissionSetup(*(jax.tree.map(lambda leaf, row=row: leaf[row], tree) for tree, row in rows), self.spec)
