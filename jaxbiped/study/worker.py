"""What a worker of a cluster does: shards, one at a time, and saying how far it is."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from functools import cache

import jax
import polars as pl
from distributed import get_worker
from distributed.versions import get_package_info

from jaxbiped.errors import InputError
from jaxbiped.mission.batched_driver import Tally
from jaxbiped.study.batching import Group, Shard
from jaxbiped.study.clock import CompileClock
from jaxbiped.study.config import StudyConfig

PACKAGES = ("jaxbiped", "jax", "jaxlib", "numpy", "mujoco", "distributed")  # of one version everywhere, and Python
PAUSE = 1.0  # [s] between two words on how far a shard is
ONE_AT_A_TIME = threading.Lock()

Compute = Callable[..., pl.DataFrame]


def versions() -> dict[str, str | None]:
    """Of what rows may depend on, as Dask can ask any worker for it, even one without this package."""
    return chosen(get_package_info(PACKAGES))


def chosen(packages: Mapping[str, str | None]) -> dict[str, str | None]:
    """Those of `PACKAGES` and of Python, among all that Dask tells."""
    return {name: packages.get(name) for name in ("python", *PACKAGES)}


def refuse_other_versions(worker: str, there: Mapping[str, str | None], here: Mapping[str, str | None]) -> None:
    """Raise `InputError` that names a worker and what it has of other versions than the client."""
    changes = [
        f"{name} {there.get(name) or 'nothing'} (here {here[name]})" for name in here if there[name] != here[name]
    ]
    if changes:
        message = f"has {', '.join(changes)}; all workers must have what the client has"
        raise InputError(message, field=f"worker {worker}")


def devices() -> tuple[int, str]:
    """How many devices this process has, and of what kind."""
    return jax.local_device_count(), jax.local_devices()[0].device_kind


def refuse_other_device(worker: str, there: str, wanted: str) -> None:
    """Raise `InputError` where rows would be of several kinds of devices."""
    if there != wanted:
        raise InputError(
            f"must have devices of the kind of the others, {wanted}", field=f"worker {worker}", value=there
        )


@cache
def clock() -> CompileClock:
    """Of this process."""
    return CompileClock()


def work(
    compute: Compute,
    config: StudyConfig,
    group: Group,
    shard: Shard,
    topic: str,
    wanted: Mapping[str, str | None],
    kind: str,
) -> tuple[pl.DataFrame, str, float]:
    """The task: the rows of a shard, the worker's address, and seconds that it spent compiling.

    Args:
      compute: as `evaluate.compute`.
      topic: of the events that say how far it is: (shard number, missions ended, of these reached).
      wanted, kind: versions and the kind of device that a worker must have.

    Raises:
      InputError: this worker has others.
    """
    worker = get_worker()
    refuse_other_versions(worker.address, versions(), wanted)
    refuse_other_device(worker.address, devices()[1], kind)
    last = [time.monotonic()]

    def report(tally: Tally) -> None:
        if time.monotonic() - last[0] > PAUSE:
            last[0] = time.monotonic()
            worker.log_event(topic, (shard.number, tally.ended, tally.reached))

    with ONE_AT_A_TIME:  # its queues use all threads that the worker has
        before = clock().seconds
        frame = compute(config, group, shard, report, workers=worker.state.nthreads)
        return frame, worker.address, clock().seconds - before
