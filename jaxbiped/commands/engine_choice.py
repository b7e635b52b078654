"""Where the shards of a study are computed: options shared by several commands."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console

from jaxbiped.commands.options.engine import EngineArgs
from jaxbiped.errors import InputError
from jaxbiped.study.run_study import HERE, Engine


@contextmanager
def chosen_engine(args: EngineArgs, console: Console, shards: int, ordered: bool = False) -> Iterator[Engine]:
    """Where shards are computed.

    Args:
      shards: number of shards of the study.
      ordered: whether shards must be returned in order.

    Raises:
      InputError: the scheduler does not exist, or its workers cannot be used.
    """
    if args.scheduler is None and args.workers is None:
        yield HERE
        return
    if args.scheduler is not None and args.workers is not None:
        raise InputError("does not go with --scheduler, which has its own workers", field="workers", value=args.workers)
    try:
        from jaxbiped.study.cluster import Cluster, connect, local_cluster
    except ModuleNotFoundError as error:
        field = "workers" if args.scheduler is None else "scheduler"
        raise InputError(f"needs {error.name}: pip install 'jaxbiped[cluster]'", field=field) from None
    with connect(args.scheduler) if args.scheduler else local_cluster(args.workers) as client:
        cluster = Cluster(client, ordered=ordered)
        count = cluster.workers()
        console.print(f"{count} workers at {cluster.address}, {shards} shards", highlight=False)
        if shards < count:
            console.print("fewer shards than workers: a smaller --shard would keep all of them busy", highlight=False)
        yield Engine(cluster, cluster.device, lambda: cluster.seconds)
