"""Play the missions of the page."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped.arenas import Arena
from jaxbiped.mission.log import MissionLog
from jaxbiped.mission.oracle import oracle_plan
from jaxbiped.mission.params import MissionConfig, mission_spec
from jaxbiped.mission.sensor_rig import SensorRig
from jaxbiped.reproduction.account import Record, record, typical
from jaxbiped.reproduction.mishaps import MISHAPS, Ending, suffer
from jaxbiped.reproduction.paper import EXPERIMENTS, TABLE_1, Experiment
from jaxbiped.reproduction.staging import play
from jaxbiped.reproduction.table_1 import SCENES, Shown, shown
from jaxbiped.study.runner import seeing

Done = Callable[[], None]  # called after each mission


def experiment(
    item: Experiment, arena: Arena, config: MissionConfig, seeds: range, rig: SensorRig | None, done: Done
) -> tuple[tuple[Record, ...], Record, MissionLog]:
    """Play an experiment with several seeds: all its missions, the one to show, and that one's log."""
    records, logs = [], {}
    for seed in seeds:
        mission = play(arena, config, item.strategy, seed, rig)
        records.append(record(item, item.strategy, seed, mission, config.durations))
        logs[seed] = mission.log
        best = typical(records)
        done()
    return tuple(records), best, logs[best.seed]


def strategies(
    arenas: Mapping[str, Arena], config: MissionConfig, seed: int, rig: SensorRig | None, done: Done
) -> dict[tuple[str, str], Shown]:
    """Play each strategy in each test scene of Table 1."""
    found = {}
    for scene, kinds in SCENES.items():
        for name in TABLE_1:
            found[name, scene] = shown(arenas[scene], play(arenas[scene], config, name, seed, rig), config, kinds)
            done()
    return found


def mishaps(sensor: str, seed: int, done: Done) -> tuple[Ending, ...]:
    """Play each mission that cannot succeed."""
    config, found = MissionConfig(sensor=sensor), []
    with seeing(config) as rig:
        for mishap in MISHAPS:
            found.append(suffer(mishap, config, seed, rig))
            done()
    return tuple(found)


MISSIONS = len(TABLE_1) * len(SCENES), len(MISHAPS), len(EXPERIMENTS)  # of `strategies`, `mishaps`, and a repeat


def shortest(arena: Arena, config: MissionConfig, strategy: str) -> float | None:
    """[m] Length of the path preferred by Eq. (1) with perfect knowledge of a scene; None if there is none."""
    batch, points = (
        jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], tree) for tree in (arena, config.params(strategy))
    )
    spec = mission_spec(config, tuple(map(float, arena.size_xy.round(6))))
    length = float(oracle_plan(batch, points, spec).length[0, 0])
    return length if np.isfinite(length) else None


def lintel(arena: Arena) -> float:
    """[m] Depth of the thinnest overhead box; 0 without one."""
    boxes = jax.device_get(arena.boxes)
    depths = 2 * np.minimum(boxes.half_x, boxes.half_y)[boxes.used & boxes.overhead]
    return float(depths.min()) if len(depths) else 0.0
