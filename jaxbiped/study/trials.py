"""Missions under many cost vectors on the same arenas: what a search for costs asks again and again."""

from __future__ import annotations

import itertools
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from jaxbiped.arenas.families import SIZE_X, SIZE_Y
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.queue import Jobs, OnProgress, Result, Tally, compile_queue, tally
from jaxbiped.mission.settings import MissionConfig, program
from jaxbiped.planning import Costs
from jaxbiped.study.evaluate import WORKERS, draw

VECTORS, BLOCK = 8, 32  # cost vectors and arenas that one queue has room for
SLOTS = 32  # missions at once: a queue that is not much longer than its slots idles most of them at its end
NAMES = ("c0", "c1", "c2", "c3", "c4")  # in the order of the cost vectors


@dataclass(frozen=True)
class Trials:
    """Missions of one kind on the arenas of one seed."""

    mission: MissionConfig  # its costs are not used
    strategy: str
    families: tuple[str, ...]
    seed: int

    def __call__(
        self,
        costs: Float[np.ndarray, "P 5"],
        index: Int[np.ndarray, "A"],
        on_progress: OnProgress = lambda tally: None,
    ) -> Result:
        """All cost vectors on all arenas `index`: results [P, A], on the host.

        The same arenas with the same noise as those of a study with this seed: common random numbers, so that
        differences between cost vectors are theirs. Any number of vectors and arenas shares one compiled program.
        Consumes `jax.random.key(seed)`.

        Args:
          on_progress: called with the tally of the missions so far, now and then.
        """
        static = program(self.mission, (SIZE_X, SIZE_Y))
        base = self.mission.settings(self.strategy)
        settings = jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, (VECTORS, *jnp.shape(leaf))), base)
        key, length = jax.random.key(self.seed), VECTORS * BLOCK
        pieces = list(itertools.product(range(0, len(index), BLOCK), range(0, len(costs), VECTORS)))
        kind = Result(*(np.int32, np.float32, np.float32, np.int32, np.int32, np.float32))
        out = jax.tree.map(lambda dtype: np.zeros((len(costs), len(index)), dtype), kind)
        done, lock, stop = [Tally(0, 0)], threading.Lock(), threading.Event()

        def look(_: object) -> None:
            if stop.is_set():
                raise InterruptedError

        def play(piece: tuple[int, int]) -> None:
            first, vector = piece
            here, vectors = index[first : first + BLOCK], costs[vector : vector + VECTORS]
            count, pairs = len(here), len(here) * len(vectors)
            batch, seeds = draw(key, jnp.asarray(np.resize(here, BLOCK)), self.families)
            columns = np.resize(vectors, (VECTORS, 5)).T.astype(np.float32)
            points = replace(settings, costs=Costs(*(jnp.asarray(column) for column in columns)))
            arena, point = np.arange(length) % count, np.arange(length) // count % len(vectors)
            jobs = Jobs(jnp.asarray(arena), jnp.asarray(point), seeds[arena], jnp.int32(pairs))
            work = compile_queue(batch, points, jobs, static, SLOTS)
            result = jax.device_get(work(batch, points, jobs, look))
            for rows, found in zip(jax.tree.leaves(out), jax.tree.leaves(result), strict=True):
                rows[vector : vector + VECTORS, first : first + BLOCK] = found[:pairs].reshape(len(vectors), count)
            with lock:
                done[0] += tally(result.code[:pairs])
                on_progress(done[0])

        if pieces:
            play(pieces[0])  # compiles, once
        with ThreadPoolExecutor(WORKERS) as pool:
            try:
                list(pool.map(play, pieces[1:]))
            except BaseException:
                stop.set()  # an interrupt shall not wait for all queues
                pool.shutdown(cancel_futures=True)
                raise
        return out


def objective(result: Result, penalty: float) -> Float[np.ndarray, "*S"]:
    """Seconds of each mission: its time where it reached the goal, `penalty` where it failed, and never more than that.

    The mean of it is the penalised average run time by which solvers are compared that may fail.
    """
    time = np.minimum(result.time.astype(float), penalty)
    return np.where(result.code == Code.REACHED, time, penalty)
