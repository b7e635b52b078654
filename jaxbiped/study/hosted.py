"""Missions whose robots measure on the host, by rendered stereo: several at once, each stepped in a thread."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager

import jax
import numpy as np

from jaxbiped.jax_settings import with_own_settings
from jaxbiped.mission.batched_driver import OnProgress, Result, Tally, ending, no_results
from jaxbiped.mission.metric import begun
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.recorded_driver import run_bare
from jaxbiped.mission.sensor_rig import SensorRig, StereoRig
from jaxbiped.sensing.config import CameraConfig
from jaxbiped.study.workload import Workload


@with_own_settings
def run_on_host(
    workload: Workload,
    on_progress: OnProgress,
    open_rig: Callable[[], AbstractContextManager[SensorRig]],
    workers: int = 2,
) -> Result:
    """As `queues.run_all`, for a sensor that measures on the host: each worker is a thread with its own rig.

    OpenGL and OpenCV run while the other thread has the interpreter. Which worker plays a mission does not change its
    result.

    Args:
      open_rig: creates a rig in the thread that uses it, and closes it there.
      workers: by default one for each core; OpenGL and OpenCV have additional threads.
    """
    kinds, count = workload.kinds, workload.count
    first = workload.setup_of(0, 0)
    metrics = jax.eval_shape(lambda arena, params: begun(params.metrics, arena, params), first.arena, first.params)
    out, left = no_results(kinds, count, metrics=metrics), np.ndindex(count, kinds)
    done, lock, stop = Tally(0, 0), threading.Lock(), threading.Event()

    def play(_: int) -> None:
        nonlocal done
        with contextlib.ExitStack() as stack:
            with lock:
                rig = stack.enter_context(open_rig())
            while not stop.is_set():
                with lock:
                    job = next(left, None)
                if job is None:
                    return
                arena, point = job
                setup = workload.setup_of(arena, point)
                world = jax.device_get(run_bare(setup, workload.seeds[arena], rig))
                last = jax.device_get(ending(world, setup.arena.goal_xy))
                with lock:
                    for column, value in zip(jax.tree.leaves(out), jax.tree.leaves(last), strict=True):
                        column[point, arena] = value[0]
                    done = done + Tally(1, int(world.code[0] == Code.REACHED))
                    on_progress(done)

    def play_or_stop(number: int) -> None:
        try:
            play(number)
        except BaseException:
            stop.set()  # on an interrupt or an error, do not wait for all remaining missions
            raise

    with ThreadPoolExecutor(workers) as pool:
        try:
            list(pool.map(play_or_stop, range(min(workers, count * kinds))))
        except BaseException:
            stop.set()
            raise
    return out


def open_rig(camera: CameraConfig, localisation: str) -> contextlib.closing[StereoRig]:
    """Rendered stereo, until it is closed; both in the thread that uses it."""
    return contextlib.closing(StereoRig(camera, localisation))
