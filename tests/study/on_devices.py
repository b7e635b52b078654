"""The same study and the same fields on some of the devices of one process: run with several, it writes what each gave.

python -m tests.study.on_devices FOLDER SENSOR COUNT ...
"""

import sys
from pathlib import Path

import jax
import numpy as np
import polars as pl

from jaxbiped import planning
from jaxbiped.study.run_study import Engine, compute_study
from jaxbiped.study.sweep import SweepConfig

AXIS = {"field": "costs.c3", "values": (5.0, 20.0)}


def config(sensor):
    """Two shards, the second not full; 28 missions in the first, which 4 devices do not share evenly."""
    small = {"arenas": 11, "shard": 7, "strategies": ("full", "floor_only"), "axes": (AXIS,)}
    return SweepConfig(**small, mission={"sensor": sensor, "limits": {"max_decisions": 12}})


def fields(devices):
    """Of a batch that no number of devices divides, the odd ones invalid."""
    rng = np.random.default_rng(0)
    shape = 37, 28, 36
    classes = rng.choice([0, 1, 1, 1, 2, 3, 4], shape).astype(np.int8)
    levels = (classes == 2) * rng.integers(0, 2, shape).astype(np.int8)
    goals = np.stack([rng.integers(0, 28, 37), rng.integers(0, 36, 37)], 1)
    costs = planning.Costs(c3=np.linspace(1, 20, 37, dtype=np.float32))
    return planning.field(classes, levels, costs, None, goals, devices=devices)


if __name__ == "__main__":
    folder, sensor, *counts = sys.argv[1:]
    everything = jax.local_devices()
    np.savez(Path(folder) / "cores.npz", *jax.tree.leaves(fields(None)))
    for count in map(int, counts):
        jax.local_devices = lambda count=count: everything[:count]
        np.savez(Path(folder) / f"{count}.npz", *jax.tree.leaves(fields(everything[:count])))
        study = config(sensor)
        told = []
        compute_study(
            Path(folder) / str(count), study, points=tuple(study.points()), engine=Engine(on_progress=told.append)
        )
        rows = pl.read_parquet(Path(folder) / str(count) / "rows" / "*.parquet")
        assert (told[-1].ended, told[-1].total) == (rows.height, rows.height)
        assert told[-1].reached == rows["success"].sum()
