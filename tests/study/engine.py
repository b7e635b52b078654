"""A made-up engine: rows at once, and a mark each time that a shard is begun. Run as a script it conducts a study."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import polars as pl

from jaxbiped.study.batching import shards
from jaxbiped.study.config import StudyConfig
from tests.study.synthetic import rows

STRATEGIES = ("full", "floor_only")
CONFIG = StudyConfig(arenas=40, shard=4, strategies=STRATEGIES)  # ten shards of eight rows
TABLE = rows(40, strategies=STRATEGIES)


def engine(config, on_progress=None, *, points, done, begun=None, pause=0.0):
    """The rows of `TABLE` in the shards of a study of one sweep point."""
    for shard in shards(config, 1):
        if shard.number not in done:
            if begun:
                with open(begun, "a") as file:
                    file.write(f"{shard.number}\n")
            time.sleep(pause)
            yield shard, TABLE.filter(pl.col("arena").is_between(shard.first, shard.first + shard.count - 1))


if __name__ == "__main__":
    from functools import partial

    from jaxbiped.study.run_study import Engine, compute_study

    compute_study(Path(sys.argv[1]), CONFIG, engine=Engine(partial(engine, begun=sys.argv[2], pause=0.15)))
