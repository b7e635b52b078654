"""Self-localisation with and without landmarks, on the same arenas with the same noise.

    python -m sweeps.studies.localisation [--arenas N] [--executor kinematic|sampled|native] [--sensor raycast|stereo]
        [--scenes-only] [--ways landmarks visual ...] [--worse 5 10]

Printed for each way of localisation: how many missions reach the goal, the paired difference to landmarks with its
interval (Tango) and McNemar's p, and how far off the robot believes to stand when it gets there. `--worse` repeats
`visual` with so many times the errors that rendered pictures have (ray-cast sensor).
"""

from __future__ import annotations

import contextlib
import sys
import time
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
from jaxbiped.arenas.families import FAMILIES, SIZE_X, SIZE_Y
from jaxbiped.mission.arena_batch import draw
from jaxbiped.mission.batched_driver import Result, stack
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import SIMULATED, MissionConfig, mission_spec
from jaxbiped.mission.sensor_rig import RENDERED
from jaxbiped.sensing import VisualConfig
from jaxbiped.sensing.counter_rng import from_key
from jaxbiped.statistics.paired import success_difference
from jaxbiped.study.hosted import open_rig, run_on_host
from jaxbiped.study.queues import run_all
from jaxbiped.study.walks import walk_all
from jaxbiped.study.workload import Workload

SCENES = sorted((Path(__file__).parents[2] / "configs" / "scenes").glob("experiment_*.toml"))
WAYS = ("landmarks", "odometry", "visual", "icp", "both")


def play(config: MissionConfig, batch, seeds, count: int, strategy: str) -> Result:
    """Missions of one kind on a batch of arenas: leaves [count]."""
    spec = mission_spec(config, (SIZE_X, SIZE_Y))
    workload = Workload(batch, seeds, stack([config.params(strategy)]), count, spec)
    see = partial(open_rig, config.camera, config.localisation) if config.sensor in RENDERED else None
    if config.executor in SIMULATED:
        with see() if see else contextlib.nullcontext() as rig:
            result = walk_all(workload, lambda _: None, config.walk, rig)
    elif see:
        result = run_on_host(workload, lambda _: None, see)
    else:
        result = run_all(workload, lambda _: None)
    return jax.tree.map(lambda leaf: np.asarray(leaf)[0], result)


def scenes() -> tuple:
    """The scenes of the paper's experiments, and the seeds of their noise."""
    arenas = [load_scene(path)[1] for path in SCENES]
    seeds = jnp.stack([from_key(jax.random.key(number)) for number in range(len(SCENES))])
    return jax.tree.map(jnp.asarray, stack(arenas)), seeds, len(SCENES)


def main(
    arenas: int = 300,
    executor: Literal["kinematic", "sampled", "native", "mjx"] = "kinematic",
    sensor: Literal["raycast", "stereo"] = "raycast",
    ways: tuple[Literal[WAYS], ...] = WAYS,
    scenes_only: bool = False,
    worse: tuple[float, ...] = (),
    preset: str = "rendered",
    seed: int = 0,
    strategy: str = "full",
) -> None:
    """Run `arenas` random arenas of all families, or the six scenes, with each way of localisation."""
    batch, seeds = draw(jax.random.key(seed), jnp.arange(arenas), FAMILIES)
    if scenes_only:
        batch, seeds, arenas = scenes()
    what = f"{arenas} {'scenes' if scenes_only else 'random arenas'}, strategy {strategy}"
    columns = "localisation", "reached", "minus landmarks", "p", "error at the goal", "95 %", "of yaw", "95 %"
    table = Table(*columns, title=f"{what}, executor {executor}, sensor {sensor}, preset {preset}")
    reached = {}
    for way, times in [(way, 1.0) for way in ways] + [("visual", times) for times in worse]:
        begun = time.time()
        visual = VisualConfig()
        scaled = {name: times * getattr(visual, name) for name in ("forward", "left", "yaw")}
        config = MissionConfig(
            executor=executor,
            sensor=sensor,
            localisation=way,
            preset=preset,
            visual=visual.model_copy(update=scaled),
        )
        result = play(config, batch, seeds, arenas, strategy)
        there = reached[way] = result.code == Code.REACHED
        difference = "", ""
        if way != "landmarks" and "landmarks" in reached:
            found = success_difference(there, reached["landmarks"])
            interval = f"[{100 * found.low:+.1f}, {100 * found.high:+.1f}]"
            difference = f"{100 * found.estimate:+.1f} points {interval}", f"{found.p:.3f}"
        off, turned = (np.percentile(error[there], (50, 95)) if there.any() else np.full(2, np.nan)
                       for error in (result.pose_error, np.rad2deg(result.yaw_error)))  # fmt: skip
        row = (
            way if times == 1 else f"{way}, errors x {times:g}",
            f"{there.mean():.1%}",
            *difference,
            *(f"{100 * value:.2f} cm" for value in off),
            *(f"{value:.2f} deg" for value in turned),
        )
        table.add_row(*row)
        print("  ".join(row), f" ({time.time() - begun:.0f} s)", file=sys.stderr)
    Console(width=130).print(table)


if __name__ == "__main__":
    tyro.cli(main)
