"""A study on many machines: Dask hands shards to worker processes, and this process writes the results.

A shard is one task. It is a function of the study's config and of its number alone, so that a task whose worker died
is computed by another one, and the rows equal those of a study on one machine. A worker computes one shard at a time,
with as many queues as it has threads, and compiles for itself: processes share compilations only if JAX keeps them
on disk, in the folder that the environment variable JAX_COMPILATION_CACHE_DIR names to each of them.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import time
import uuid
import warnings
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import CancelledError
from itertools import islice
from pathlib import Path
from urllib.parse import urlsplit

import polars as pl
from distributed import Client, Future, LocalCluster, wait
from distributed.comm import CommClosedError
from distributed.core import rpc
from distributed.scheduler import KilledWorker
from distributed.versions import VersionMismatchWarning

from jaxbiped.core.names import KNOWN
from jaxbiped.core.registry import PLACE
from jaxbiped.devices import cores
from jaxbiped.errors import InputError
from jaxbiped.files import reason
from jaxbiped.mission.batched_driver import Tally
from jaxbiped.study import evaluation, worker
from jaxbiped.study.batching import Group, Point, Shard, groups_of, shards
from jaxbiped.study.config import StudyConfig
from jaxbiped.study.evaluation import Progress
from jaxbiped.study.worker import Compute

ANSWER = 5.0  # [s] time limit for the scheduler to answer
WAITING = 30.0  # [s] time limit for a worker to appear, if there is none
LOOK = 1.0  # [s] between two checks of the workers
# What a worker runs first: an interrupt from the terminal is meant for the client, which ends the workers.
DEAF = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"
LOST = (CancelledError, CommClosedError, OSError)  # what Dask raises when the scheduler is gone


class Cluster:
    """A way to compute the shards of `compute_study`: shards computed by the workers of a Dask scheduler.

    Args:
      client: a connected client. All its workers are checked now, those that join later with their first shard.
      ordered: return shards in order of their numbers, as required by a rule that may end the study: the order in which
        they end depends on their content.
      compute: called like `evaluate.compute`, on a worker.

    Raises:
      InputError: no worker appears, or one has other versions or another kind of device than the rest; while shards
        are computed also: the scheduler or all workers are gone, or several workers died of one shard.
    """

    def __init__(self, client: Client, *, ordered: bool = False, compute: Compute = evaluation.compute):
        self.client, self.ordered, self.compute = client, ordered, compute
        self.address = client.scheduler.address
        self.compiling: dict[str, float] = {}  # [s] for each worker
        self.seen = time.monotonic()  # last time that there was a worker
        while not self.workers():
            time.sleep(0.1)
        self.versions = worker.versions()
        with self.connection():
            for address, answer in sorted(client.get_versions(packages=worker.PACKAGES)["workers"].items()):
                worker.refuse_other_versions(address, worker.chosen(answer["packages"]), self.versions)
            devices = client.run(worker.devices)
        self.kind = next(iter(devices.values()))[1]
        for address, (_, kind) in sorted(devices.items()):
            worker.refuse_other_device(address, kind, self.kind)
        self.device = f"{sum(count for count, _ in devices.values())} x {self.kind}"

    @property
    def seconds(self) -> float:
        """Compile time of the worker that compiled longest, since they compile in parallel."""
        return max(self.compiling.values(), default=0.0)

    def __call__(
        self,
        config: StudyConfig,
        on_progress: Callable[[Progress], None] | None = None,
        *,
        points: Sequence[Point] | None = None,
        done: Collection[int] = (),
    ) -> Iterator[tuple[Shard, pl.DataFrame]]:
        """Evaluate shards like `evaluate.evaluate`."""
        groups = groups_of(config, points)
        left = [shard for shard in shards(config, len(groups), swept=bool(points)) if shard.number not in done]
        total = sum(groups[shard.group].rows(shard) for shard in left)
        refuse_own(config)
        board, topic = Board(on_progress, total), f"jaxbiped-{uuid.uuid4()}"
        todo = iter(left)
        running: dict[Future, Shard] = {}
        held: dict[int, tuple[Shard, pl.DataFrame]] = {}  # waiting for earlier ones
        turns = [shard.number for shard in reversed(left)]  # the next one last
        self.client.subscribe_topic(topic, board.hear)
        self.seen = time.monotonic()
        try:
            while turns:
                # As many shards as workers, so that none waits at a worker while another worker is idle. If
                # their order matters, not far beyond the next one.
                count = self.workers()
                room = min(count - len(running), 2 * count - len(running) - len(held))
                for shard in islice(todo, max(0, room)):
                    running[self.submit(config, groups[shard.group], shard, topic)] = shard
                for future in self.ended(running):
                    shard = running.pop(future)
                    frame = self.result(future, shard)
                    board.end(shard.number, frame)
                    held[shard.number] = shard, frame
                while held and (turns[-1] in held or not self.ordered):
                    turn = turns.pop()
                    yield held.pop(turn if self.ordered else next(iter(held)))
        finally:
            with contextlib.suppress(*LOST):
                self.client.unsubscribe_topic(topic)
                self.client.cancel(list(running))

    def submit(self, config: StudyConfig, group: Group, shard: Shard, topic: str) -> Future:
        """Submit a shard as a task."""
        arguments = self.compute, config, group, shard, topic, worker.Wanted(self.versions, self.kind)
        with self.connection():
            return self.client.submit(worker.work, *arguments, key=f"shard-{shard.number}-{topic}", pure=False)

    def ended(self, running: Collection[Future]) -> list[Future]:
        """The tasks that have ended, after at most `LOOK` seconds."""
        with self.connection(), self.client.as_current():
            if not running:
                time.sleep(LOOK)
                return []
            try:
                done = wait(list(running), timeout=LOOK, return_when="FIRST_COMPLETED").done
            except TimeoutError:
                return []
        return [future for future in running if future in done]

    def result(self, future: Future, shard: Shard) -> pl.DataFrame:
        """The rows of a completed task."""
        if future.status == "error":
            error = future.exception()
            if isinstance(error, KilledWorker):
                message = "its workers died one after another, perhaps for lack of memory: a smaller --shard needs less"
                raise InputError(message, field=f"shard {shard.number}")
            raise error
        with self.connection():
            frame, address, seconds = future.result()
        self.compiling[address] = self.compiling.get(address, 0.0) + seconds
        return frame

    def workers(self) -> int:
        """The number of workers; `InputError` if there has been none for too long."""
        with self.connection():
            count = len(self.client.nthreads())
        if count:
            self.seen = time.monotonic()
        elif time.monotonic() - self.seen > WAITING:
            message = f"has had no worker for {WAITING:.0f} s; start some: `dask worker {self.address}`"
            raise InputError(message, field="scheduler", value=self.address)
        return count

    @contextlib.contextmanager
    def connection(self) -> Iterator[None]:
        """Context in which the scheduler may turn out to be gone."""
        try:
            yield
        except LOST:
            message = "is gone; stored shards are readable, and --resume continues the study"
            raise InputError(message, field="scheduler", value=self.address) from None


class Board:
    """The progress reported by workers for their shards, added up."""

    def __init__(self, on_progress: Callable[[Progress], None] | None, total: int):
        self.on_progress, self.total = on_progress, total
        self.tallies: dict[int, Tally] = {}
        self.over: set[int] = set()

    def hear(self, event: tuple[float, Sequence[int]]) -> None:
        """Receive a worker's report; called from Dask's thread."""
        number, ended, reached = event[1]
        if number not in self.over:
            self.tell(number, Tally(ended, reached))

    def end(self, number: int, frame: pl.DataFrame) -> None:
        """Record that a shard has ended."""
        self.over.add(number)
        self.tell(number, Tally(len(frame), int(frame["success"].sum())))

    def tell(self, number: int, tally: Tally) -> None:
        """Pass on the total progress."""
        self.tallies[number] = tally
        whole = sum(list(self.tallies.values()), Tally(0, 0))
        if self.on_progress:
            self.on_progress(Progress(whole.ended, whole.reached, self.total))


def refuse_own(config: StudyConfig) -> None:
    """Raise `InputError` about components that exist only in this process, where no worker could find them."""
    for name in config.families:
        if name not in KNOWN and not name.endswith(".toml") and not PLACE.fullmatch(name):
            message = "is registered in this process only; name it package.module:name so that workers can find it"
            raise InputError(message, field="families", value=name)


@contextlib.contextmanager
def connect(scheduler: str) -> Iterator[Client]:
    """A client of the scheduler at an address; `InputError` if there is none."""
    knock(scheduler)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VersionMismatchWarning)  # we report it ourselves
        client = Client(scheduler, timeout=ANSWER, set_as_default=False)
    with client:
        yield client


def knock(scheduler: str) -> None:
    """Raise `InputError` unless a Dask scheduler answers; `Client` itself would retry for long and print much."""
    try:
        parts = urlsplit(scheduler if "://" in scheduler else f"tcp://{scheduler}")
        sound = parts.scheme in ("tcp", "tls") and None not in (parts.hostname, parts.port)
    except ValueError:
        sound = False
    if not sound:
        raise InputError("must be the address of a Dask scheduler, tcp://host:8786", field="scheduler", value=scheduler)

    async def ask() -> str:
        async with rpc(scheduler, timeout=ANSWER) as listener:
            return (await listener.identity())["type"]

    try:
        socket.create_connection(
            (parts.hostname, parts.port), timeout=ANSWER
        ).close()  # fails at once, whereas Dask retries
        kind = asyncio.run(asyncio.wait_for(ask(), ANSWER))
    except Exception as error:  # another program listening there may answer anything
        problem = reason(error) if isinstance(error, OSError) and error.strerror else "the listening program is not one"
        message = f"no Dask scheduler answers there: {problem}"
        raise InputError(message, field="scheduler", value=scheduler) from None
    if kind != "Scheduler":
        raise InputError(
            f"is the address of a Dask {kind.lower()}, not of its scheduler", field="scheduler", value=scheduler
        )


def as_here() -> str:
    """Code that a worker runs first, so that it finds the modules of the working directory, as this process does."""
    return f"import sys; sys.path.append({str(Path.cwd())!r})"


@contextlib.contextmanager
def local_cluster(workers: int) -> Iterator[Client]:
    """A client of worker processes on this machine, which share its cores and end with the client."""
    threads = max(1, cores() // workers)
    with (
        LocalCluster(
            n_workers=workers,
            threads_per_worker=threads,
            processes=True,
            dashboard_address="127.0.0.1:0",
            memory_limit=0,  # do not kill a worker for its memory while compiling
            silence_logs=logging.CRITICAL,
            env={"PJRT_NPROC": threads},  # XLA's own threads
            preload=[DEAF, as_here()],
        ) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        yield client
