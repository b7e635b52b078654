"""Missions of simulated bipeds on many arenas."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Int, UInt32

from jaxbiped.arenas.arena import Arena
from jaxbiped.jax_settings import with_own_settings
from jaxbiped.mission.batched_driver import Jobs, OnProgress, Result
from jaxbiped.mission.params import MissionParams, MissionSpec
from jaxbiped.mission.primitive_schedule import WalkConfig
from jaxbiped.mission.sensor_rig import SensorRig
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.simulated_driver import walk


@with_own_settings
def walk_all(
    batch: Arena,
    seeds: UInt32[Array, "A"],
    points: MissionParams,
    count: int,
    spec: MissionSpec,
    on_progress: OnProgress,
    config: WalkConfig,
    population_of: Int[np.ndarray, "P"],
    rig: SensorRig | None = None,
) -> Result:
    """Run every arena under every point, as `queues.run_all`: results [P, count], on the host."""
    kinds = jax.tree.leaves(points)[0].shape[0]
    point, arena = (grid.ravel() for grid in np.meshgrid(np.arange(kinds), np.arange(count), indexing="ij"))
    place = arena + seeds.shape[0] * population_of[point]
    jobs = Jobs(jnp.asarray(place), jnp.asarray(point), seeds[arena], jnp.int32(len(arena)))
    result = walk(MissionSetup(batch, points, spec), jobs, config, on_progress, rig=rig)
    return jax.tree.map(lambda leaf: leaf.reshape(kinds, count, *leaf.shape[1:]), result)
