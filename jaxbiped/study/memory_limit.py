"""The memory that a study needs, so that one that does not fit is rejected before it is compiled."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from jaxbiped.core.sizes import JOBS, POINTS, filled
from jaxbiped.errors import InputError
from jaxbiped.mission.batched_driver import SLOTS
from jaxbiped.mission.params import MissionSpec

# Bytes, measured as growth of the resident memory, and rounded up.
POINT = 25_000  # a sweep point: its config
SETTING = 35_000  # and its numbers, for each strategy
ROW = 2_000  # a mission of a shard: its job, its result on device and host, its row
MAPS = 4  # copies of a slot's map: the queue's, and those made by an update
SHARE = 0.8  # of the available memory


def memory() -> int:
    """Bytes available to this process: of the machine, or of its control group."""
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    with contextlib.suppress(OSError, ValueError):
        total = min(total, int(Path("/sys/fs/cgroup/memory.max").read_text()))
    return int(SHARE * total)


def most_points(strategies: int) -> int:
    """How many sweep points fit, with one arena at a time."""
    return memory() // (POINT + strategies * (SETTING + ROW))


def map_bytes(spec: MissionSpec, workers: int) -> int:
    """Bytes of the maps of all slots."""
    height, width = spec.grid.shape
    layers = spec.grid.levels + 4 + spec.grid.ground_levels
    return 4 * height * width * layers * SLOTS * workers * MAPS


def check_memory(spec: MissionSpec, points: int, strategies: int, arenas: int, workers: int) -> None:
    """Raise `InputError` if a shard of `arenas` under `points` does not fit, saying what would.

    Args:
      points: of one group, all in one call; memory is counted for as many as their program is compiled for.
      workers: queues at once, each with its own maps.
    """
    kinds, maps = points * strategies, map_bytes(spec, workers)
    left = memory() - maps - points * POINT - filled(kinds, POINTS) * SETTING
    fit = jobs_that_fit(left, workers) // kinds
    if fit < 1:
        size = f"{points} points x {strategies} strategies with maps of {spec.grid.shape} cells"
        least = memory() - left + workers * filled(-(-kinds // workers), JOBS) * ROW
        message = f"{size} need {least / 2**30:.1f} GiB, of {memory() / 2**30:.1f} available"
        raise InputError(f"{message}; sweep fewer points at once, or on a coarser pitch", field="axes")
    if arenas > fit:
        message = f"{points} points x {strategies} strategies: at most {fit} arenas a shard fit in memory"
        raise InputError(message, field="shard", value=arenas)


def jobs_that_fit(left: int, workers: int) -> int:
    """How many missions fit into so many bytes, in queues as long as programs are compiled for (`core.sizes`)."""
    length = max(left, 0) // (workers * ROW)
    return workers * (1 << length.bit_length() - 1) if length >= JOBS else 0
