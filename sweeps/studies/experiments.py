"""The six experiments of the paper, ours beside the paper's figures where it gives any (Tables 3 and 4).

    python -m sweeps.studies.experiments [--seeds N] [--executor kinematic|sampled|native|mjx] [--sensor raycast|stereo]

Each scene is run with several noise seeds; printed are how the missions ended, and the median distance and time of
those that reached the goal.
"""

from __future__ import annotations

import contextlib
from functools import partial
from pathlib import Path
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from jaxbiped.arenas import load_scene
from jaxbiped.mission.batched_driver import stack
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import SIMULATED, MissionConfig, mission_spec
from jaxbiped.mission.sensor_rig import RENDERED
from jaxbiped.reproduction import EXPERIMENTS, Experiment
from jaxbiped.sensing.counter_rng import from_key
from jaxbiped.study.hosted import open_rig, run_on_host
from jaxbiped.study.queues import run_all
from jaxbiped.study.walks import walk_all
from jaxbiped.study.workload import Workload

SCENES = Path(__file__).parents[2] / "configs" / "scenes"


def play(item: Experiment, config: MissionConfig, seeds: int):
    """All missions of one experiment, at once: `Result` with leaves [seeds]."""
    _, arena = load_scene(SCENES / f"{item.scene}.toml")
    spec = mission_spec(config, tuple(round(float(v), 6) for v in arena.size_xy))
    batch = jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, (seeds, *jnp.shape(leaf))), arena)
    noise = jnp.stack([from_key(jax.random.key(seed)) for seed in range(seeds)])
    workload = Workload(batch, noise, stack([config.params(item.strategy)]), seeds, spec)
    see = partial(open_rig, config.camera, config.localisation) if config.sensor in RENDERED else None
    if config.executor in SIMULATED:
        with see() if see else contextlib.nullcontext() as rig:
            result = walk_all(workload, lambda _: None, config.walk, rig)
    elif see:
        result = run_on_host(workload, lambda _: None, see)
    else:
        result = run_all(workload, lambda _: None, workers=1, slots=seeds)
    return jax.tree.map(lambda leaf: np.asarray(leaf)[0], result)


def main(
    seeds: int = 8,
    executor: Literal["kinematic", "sampled", "native", "mjx"] = "kinematic",
    sensor: Literal["raycast", "stereo"] = "raycast",
) -> None:
    """Run all six with `seeds` noise seeds each."""
    columns = "experiment", "strategy", "ended", "distance", "paper", "time", "paper"
    table = Table(*columns, title=f"Medians over {seeds} seeds, executor {executor}, sensor {sensor}")
    config = MissionConfig(executor=executor, sensor=sensor)
    for item in EXPERIMENTS:
        result = play(item, config, seeds)
        kinds, counts = np.unique(result.code, return_counts=True)
        reached = result.code == Code.REACHED
        table.add_row(
            str(item.number),
            item.strategy,
            ", ".join(f"{count} {Code(int(kind)).label}" for kind, count in zip(kinds, counts, strict=True)),
            f"{100 * np.median(result.distance[reached]):.0f} cm" if reached.any() else "-",
            f"{100 * item.distance:.0f} cm" if item.distance else "-",
            f"{np.median(result.time[reached]) / 60:.1f} min" if reached.any() else "-",
            f"{item.minutes:.1f} min" if item.minutes else "-",
        )
    Console().print(table)


if __name__ == "__main__":
    tyro.cli(main)
