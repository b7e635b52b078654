"""The work of a cluster's worker: shards, one at a time, and reports of its progress."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from functools import cache
from typing import NamedTuple

import jax
import polars as pl
from distributed import get_worker
from distributed.versions import get_package_info

from jaxbiped.errors import InputError
from jaxbiped.mission.batched_driver import Tally
from jaxbiped.study.batching import Group, Shard
from jaxbiped.study.clock import CompileClock
from jaxbiped.study.config import StudyConfig

PACKAGES = ("jaxbiped", "jax", "jaxlib", "numpy", "mujoco", "distributed")  # the same version everywhere, as for Python
PAUSE = 1.0  # [s] between two progress reports of a shard
ONE_AT_A_TIME = threading.Lock()

Compute = Callable[..., pl.DataFrame]


class Wanted(NamedTuple):
    """What a worker must have."""

    versions: Mapping[str, str | None]
    device_kind: str


def versions() -> dict[str, str | None]:
    """Versions that rows may depend on, in a form that Dask can request from any worker, even without this package."""
    return chosen(get_package_info(PACKAGES))


def chosen(packages: Mapping[str, str | None]) -> dict[str, str | None]:
    """The versions of `PACKAGES` and of Python, among all that Dask reports."""
    return {name: packages.get(name) for name in ("python", *PACKAGES)}


def refuse_other_versions(worker: str, there: Mapping[str, str | None], here: Mapping[str, str | None]) -> None:
    """Raise `InputError` that names a worker and its versions that differ from the client's."""
    changes = [
        f"{name} {there.get(name) or 'nothing'} (here {here[name]})" for name in here if there[name] != here[name]
    ]
    if changes:
        message = f"has {', '.join(changes)}; all workers must have the client's versions"
        raise InputError(message, field=f"worker {worker}")


def devices() -> tuple[int, str]:
    """The number of devices of this process, and their kind."""
    return jax.local_device_count(), jax.local_devices()[0].device_kind


def refuse_other_device(worker: str, there: str, wanted: str) -> None:
    """Raise `InputError` if rows would come from several kinds of devices."""
    if there != wanted:
        raise InputError(
            f"must have devices of the kind of the others, {wanted}", field=f"worker {worker}", value=there
        )


@cache
def clock() -> CompileClock:
    """The compile clock of this process."""
    return CompileClock()


def work(
    compute: Compute,
    config: StudyConfig,
    group: Group,
    shard: Shard,
    topic: str,
    wanted: Wanted,
) -> tuple[pl.DataFrame, str, float]:
    """The task: return the rows of a shard, the worker's address, and the seconds that it spent compiling.

    Args:
      compute: as `evaluate.compute`.
      topic: topic of the progress events: (shard number, missions ended, of these reached).
      wanted: what this worker must have.

    Raises:
      InputError: this worker has other ones.
    """
    worker = get_worker()
    refuse_other_versions(worker.address, versions(), wanted.versions)
    refuse_other_device(worker.address, devices()[1], wanted.device_kind)
    last = [time.monotonic()]

    def report(tally: Tally) -> None:
        if time.monotonic() - last[0] > PAUSE:
            last[0] = time.monotonic()
            worker.log_event(topic, (shard.number, tally.ended, tally.reached))

    with ONE_AT_A_TIME:  # its queues use all threads of the worker
        before = clock().seconds
        frame = compute(config, group, shard, report, workers=worker.state.nthreads)
        return frame, worker.address, clock().seconds - before
