"""Missions dealt to compiled queues, one for each core or each device."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped.core.sizes import ARENAS, JOBS, POINTS, fill_up, filled
from jaxbiped.devices import cores, mesh_of
from jaxbiped.jax_settings import with_own_settings
from jaxbiped.mission.batched_driver import SLOTS, Jobs, OnProgress, Result, Tally, Work, compile_queue, stack
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.study.workload import Workload


@with_own_settings
def run_all(
    workload: Workload,
    on_progress: OnProgress,
    workers: int | None = None,
    slots: int = SLOTS,
    devices: Sequence[jax.Device] | None = None,
) -> Result:
    """Play a workload: results [P, count], on the host.

    Jobs are dealt to as many queues as there are devices or, with one device, to as many as there are workers. The
    queue that a job is in does not change its result.

    Args:
      workers: the most queues, by default as many as cores that this process may use; fewer if each would have more
        slots than jobs.
      slots: slots of each queue. XLA fuses a program depending on its sizes, and fusion affects rounding: rows are the
        same, bit for bit, only among runs with as many slots, so few jobs get as many slots as many jobs.
      devices: by default all of this process.
    """
    size, kinds, count, block = workload.size, workload.kinds, workload.count, workload.blocks
    arena, point = (grid.ravel() for grid in np.meshgrid(np.arange(size), np.arange(kinds)))
    real = arena < count
    arena, point = np.concatenate([arena[real], arena[~real]]), np.concatenate([point[real], point[~real]])
    devices = devices or jax.local_devices()
    queues = len(devices) if len(devices) > 1 else max(1, min(workers or cores(), -(-count * kinds // slots)))
    length = filled(-(-size * kinds // queues), JOBS)
    setup = MissionSetup(fill_up(workload.arenas, ARENAS), fill_up(workload.params, POINTS), workload.spec)
    hands = []
    for number in range(queues):
        mine = np.arange(number, size * kinds, queues)
        mine = np.concatenate([mine, np.zeros(length - len(mine), int)])
        active = len(range(number, count * kinds, queues))
        place = jnp.asarray(arena[mine] + block[point[mine]])
        jobs = Jobs(place, jnp.asarray(point[mine]), workload.seeds[arena[mine]], jnp.int32(active))
        hands.append(jobs)
    if len(devices) > 1:
        jobs, mesh = stack(hands), mesh_of(devices)
        result = jax.device_get(compile_queue(setup, jobs, slots, mesh)(setup, jobs, on_progress))
        results = [jax.tree.map(lambda leaf, number=number: leaf[number], result) for number in range(queues)]
    else:
        results = run_threads(compile_queue(setup, hands[0], slots), setup, hands, on_progress)
    out = jax.tree.map(lambda leaf: np.zeros((kinds, count, *leaf.shape[1:]), leaf.dtype), results[0])
    for number, result in enumerate(results):
        mine = np.arange(number, count * kinds, queues)
        for all_rows, rows in zip(jax.tree.leaves(out), jax.tree.leaves(result), strict=True):
            all_rows[point[mine], arena[mine]] = rows[: len(mine)]
    return out


def run_threads(work: Work, setup: MissionSetup, hands: Sequence[Jobs], on_progress: OnProgress) -> list[Result]:
    """Run queues at once, one thread each."""
    tallies, lock = [Tally(0, 0)] * len(hands), threading.Lock()
    stop = threading.Event()

    def play(number: int) -> Result:
        def tell(tally: Tally) -> None:
            if stop.is_set():
                raise InterruptedError
            with lock:
                tallies[number] = tally
                on_progress(sum(tallies, Tally(0, 0)))

        return jax.device_get(work(setup, hands[number], tell))

    with ThreadPoolExecutor(len(hands)) as pool:
        try:
            return list(pool.map(play, range(len(hands))))
        except BaseException:
            stop.set()  # on an interrupt, do not wait for the whole shard
            raise
