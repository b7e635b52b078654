"""Made-up shards for a cluster: `evaluate.compute` that takes no time, and leaves a mark of where it was called."""

from __future__ import annotations

import os
import time

import polars as pl

from jaxbiped.mission.batched_driver import Tally
from jaxbiped.study.worker import PAUSE
from tests.study.engine import TABLE


def compute(config, group, shard, on_progress, workers, *, begun, pause=0.0, slow=(), deadly=()):
    """The rows of `tests.study.engine.TABLE` that are a shard's.

    Args:
      begun: file that gets a line: shard, process, threads.
      pause: [s] that it takes; for shards in `slow` longer than what lies between two words of a worker.
      deadly: shards of which a worker dies.
    """
    with open(begun, "a") as file:
        file.write(f"{shard.number} {os.getpid()} {workers}\n")
    if shard.number in deadly:
        os._exit(9)
    time.sleep(pause + 1.2 * PAUSE * (shard.number in slow))
    on_progress(Tally(2, 1))
    return TABLE.filter(pl.col("arena").is_between(shard.first, shard.first + shard.count - 1))
