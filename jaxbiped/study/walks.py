"""Missions of simulated bipeds on many arenas."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped.executors.config import WalkConfig
from jaxbiped.jax_settings import with_own_settings
from jaxbiped.mission.batched_driver import Jobs, OnProgress, Result
from jaxbiped.mission.sensor_rig import SensorRig
from jaxbiped.mission.simulated_driver import walk
from jaxbiped.study.workload import Workload


@with_own_settings
def walk_all(workload: Workload, on_progress: OnProgress, config: WalkConfig, rig: SensorRig | None = None) -> Result:
    """Play a workload as `queues.run_all`: results [P, count], on the host."""
    kinds, count = workload.kinds, workload.count
    point, arena = (grid.ravel() for grid in np.meshgrid(np.arange(kinds), np.arange(count), indexing="ij"))
    place = arena + workload.blocks[point]
    jobs = Jobs(jnp.asarray(place), jnp.asarray(point), workload.seeds[arena], jnp.int32(len(arena)))
    result = walk(workload.setup, jobs, config, on_progress, rig=rig)
    return jax.tree.map(lambda leaf: leaf.reshape(kinds, count, *leaf.shape[1:]), result)
