"""Mapping speed: batches of views into maps and classes, against the same in NumPy, one view at a time.

    python -m sweeps.benchmarks.mapping [--views 256] [--repeats 7]

Both sides use the whole machine: JAX runs one batch on all cores, NumPy runs one process per core. Views are ray-cast
from random arenas beforehand and are not timed. Both sides must come to the same classes. Compile time is apart.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import time
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped.arenas import sample
from jaxbiped.geometry.pose import Pose
from jaxbiped.mapping import Body, GridSpec, MapConfig, classify, empty, update
from jaxbiped.sensing import PRESETS, raycast
from jaxbiped.sensing.config import CameraConfig
from tests.reference import mapping as reference

SPEC = GridSpec()


def inputs(views: int):
    """Views from the start of as many random arenas, with their poses: NumPy pytrees with a leading [B]."""
    camera = CameraConfig()

    def one(k):
        arena = sample(jax.random.key(0), k)
        pose = Pose(arena.start_xyyaw[0], arena.start_xyyaw[1], jnp.float32(0), arena.start_xyyaw[2])
        seed = k.astype(jnp.uint32)
        return raycast.measure(
            arena, pose, camera.traced(), PRESETS["rendered"].stereo.traced(), camera.image, seed
        ), pose

    return jax.tree.map(np.asarray, jax.jit(jax.vmap(one))(jnp.arange(views)))


def in_jax(views, poses, body, params, refit):
    """(seconds to compile, function that maps all views and returns their classes)."""

    def one(view, pose):
        return classify(update(empty(SPEC), view, pose, body, params, SPEC, refit), params, SPEC)

    start = time.perf_counter()
    compiled = jax.jit(jax.vmap(one)).lower(views, poses).compile()
    taken = time.perf_counter() - start
    views, poses = jax.device_put((views, poses))
    return taken, lambda: jax.block_until_ready(compiled(views, poses))


def in_numpy(job):
    """Classes and levels of some views, one after the other."""
    views, poses, body, params, refit = job
    results = []
    for k in range(len(poses.x)):
        view, pose = jax.tree.map(lambda leaf, k=k: leaf[k], (views, poses))
        grid_map = reference.update(reference.empty(SPEC), view, pose, body, params, SPEC, refit)
        results.append(reference.classify(grid_map, params, SPEC))
    return np.array(results)


def best(function, repeats: int) -> float:
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--views", type=int, default=256, help="views in a batch, one an arena")
    parser.add_argument("--repeats", type=int, default=7, help="the best of so many runs counts")
    options = parser.parse_args()
    views, poses = inputs(options.views)
    body = Body(*(np.float32(v) for v in (0.10, 0.385, 0.34, 0.03, 0.002, 0.010)))
    params = jax.tree.map(np.asarray, MapConfig().params())
    cores = os.cpu_count() or 1
    rays, (rows, columns) = views.x.shape[-1], SPEC.shape
    print(f"{options.views} views of {rays} rays into {rows} x {columns} x {SPEC.levels} voxels, {cores} cores")
    with multiprocessing.get_context("spawn").Pool(cores) as pool:
        for refit in (False, True):
            taken, run = in_jax(views, poses, body, params, refit)
            parts = np.array_split(np.arange(options.views), cores)
            jobs = [
                (*jax.tree.map(lambda leaf, part=part: leaf[part], (views, poses)), body, params, refit)
                for part in parts
            ]
            theirs = np.concatenate(pool.map(in_numpy, jobs, chunksize=1))
            same = (np.stack(run(), axis=1) == theirs).mean()
            fast = best(run, options.repeats)
            slow = best(partial(pool.map, in_numpy, jobs, chunksize=1), max(2, options.repeats // 3))
            print(
                f"{'with' if refit else 'without'} refit: JAX {fast / options.views * 1e6:.0f} us a view, NumPy "
                f"{slow / options.views * 1e6:.0f} us a view, ratio {slow / fast:.1f} (wanted: 5); "
                f"same cells {same:.5f}; compiled in {taken:.1f} s"
            )


if __name__ == "__main__":
    main()
