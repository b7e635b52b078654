"""Eq. 1 with a cost for passing near obstacles, on the exact field: own edge costs, in JAX."""

from dataclasses import dataclass, field

import jax
import jax.numpy as jnp

import jaxbiped as jb


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Clearance(jb.GridPlanner):
    """A move into a cell near obstacles costs `price` more at their side, and less and less up to `clearance`."""

    clearance: float = 0.15  # [m] from which nothing is added
    price: float = 4.0  # [units of Eq. 1]
    reach: int = field(default=4, metadata={"static": True})  # [cells] that are looked at

    def edge_costs(self, problem):
        """[8, H, W]"""
        solid = problem.classes == jb.Cell.OBSTACLE
        height, width = solid.shape
        padded, away = jnp.pad(solid, self.reach), jnp.full(solid.shape, jnp.inf)
        for di in range(-self.reach, self.reach + 1):
            for dj in range(-self.reach, self.reach + 1):
                i, j = self.reach + di, self.reach + dj
                beside = padded[i : i + height, j : j + width]
                away = jnp.minimum(away, jnp.where(beside, problem.pitch * (di**2 + dj**2) ** 0.5, jnp.inf))
        extra = self.price * jnp.clip(1 - away / self.clearance, 0, 1)
        around = jnp.pad(extra, 1)
        moves = [(int(di), int(dj)) for di, dj in jb.DIRECTIONS]
        there = jnp.stack([around[1 + di : 1 + di + height, 1 + dj : 1 + dj + width] for di, dj in moves])
        return super().edge_costs(problem) + there
