"""Missions of simulated bipeds on many arenas."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, UInt32

from jaxbiped.arenas.arena import Arena
from jaxbiped.mission.footwork import WalkConfig
from jaxbiped.mission.queue import Jobs, Result
from jaxbiped.mission.settings import Program, Settings
from jaxbiped.mission.walking import walk


def walk_all(
    batch: Arena,
    seeds: UInt32[Array, "A"],
    points: Settings,
    count: int,
    static: Program,
    on_progress: Callable[[int], None],
    config: WalkConfig,
) -> Result:
    """Every arena under every point, as `evaluate.run_all`: results [P, count], on the host."""
    kinds = jax.tree.leaves(points)[0].shape[0]
    point, arena = (grid.ravel() for grid in np.meshgrid(np.arange(kinds), np.arange(count), indexing="ij"))
    jobs = Jobs(jnp.asarray(arena), jnp.asarray(point), seeds[arena], jnp.int32(len(arena)))
    result = walk(batch, points, jobs, static, config, on_progress)
    return jax.tree.map(lambda leaf: leaf.reshape(kinds, count), result)
