"""Missions under many cost vectors on the same arenas, which a search for costs needs repeatedly."""

from __future__ import annotations

import itertools
import math
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from jaxbiped.arenas.families import SIZE_X, SIZE_Y
from jaxbiped.devices import cores
from jaxbiped.jax_settings import with_own_settings
from jaxbiped.mission.arena_batch import draw
from jaxbiped.mission.batched_driver import Jobs, OnProgress, Result, Tally, Work, compile_queue, no_results, tally
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import MissionConfig, mission_spec
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.planning import Costs

VECTORS, BLOCK = 8, 16  # capacity of one queue in cost vectors and arenas
SLOTS = 16  # missions at once: in a queue not much longer than its slots, most of them would idle at its end
NAMES = ("c0", "c1", "c2", "c3", "c4")  # in the order of the cost vectors


@dataclass(frozen=True)
class Trials:
    """Missions of one kind on the arenas of one seed."""

    mission: MissionConfig  # its costs are not used
    strategy: str
    families: tuple[str, ...]
    seed: int

    @with_own_settings
    def __call__(
        self,
        costs: Float[np.ndarray, "P 5"],
        index: Int[np.ndarray, "A"],
        on_progress: OnProgress = lambda tally: None,
    ) -> Result:
        """Run all cost vectors on all arenas `index`: results [P, A], on the host.

        Uses the same arenas with the same noise as a study with this seed: common random numbers, so that differences
        are due to the cost vectors alone. Any number of vectors and arenas shares one compiled program.
        Consumes `jax.random.key(seed)`.

        Args:
          on_progress: called from time to time with the tally of the missions so far.
        """
        spec = mission_spec(self.mission, (SIZE_X, SIZE_Y))
        base = self.mission.params(self.strategy)
        params = jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, (VECTORS, *jnp.shape(leaf))), base)
        key, length = jax.random.key(self.seed), VECTORS * BLOCK
        pieces = list(itertools.product(range(0, len(index), BLOCK), range(0, len(costs), VECTORS)))
        out = jax.tree.map(lambda leaf: leaf.astype(f"{leaf.dtype.kind}4"), no_results(len(costs), len(index)))
        done, lock, stop = [Tally(0, 0)], threading.Lock(), threading.Event()

        def look(_: object) -> None:
            if stop.is_set():
                raise InterruptedError

        def deal(piece: tuple[int, int]) -> tuple[Work, tuple[MissionSetup, Jobs], tuple[slice, slice]]:
            first, vector = piece
            here, vectors = index[first : first + BLOCK], costs[vector : vector + VECTORS]
            batch, seeds = draw(key, jnp.asarray(np.resize(here, BLOCK)), self.families)
            columns = np.resize(vectors, (VECTORS, 5)).T.astype(np.float32)
            points = replace(params, costs=Costs(*(jnp.asarray(column) for column in columns)))
            arena, point = np.arange(length) % len(here), np.arange(length) // len(here) % len(vectors)
            jobs = Jobs(jnp.asarray(arena), jnp.asarray(point), seeds[arena], jnp.int32(len(here) * len(vectors)))
            place = slice(vector, vector + len(vectors)), slice(first, first + len(here))
            setup = MissionSetup(batch, points, spec)
            return compile_queue(setup, jobs, SLOTS), (setup, jobs), place

        def play(piece: tuple[int, int]) -> None:
            work, dealt, place = deal(piece)
            result = jax.device_get(work(*dealt, look))
            shape = jax.tree.leaves(out)[0][place].shape
            for rows, found in zip(jax.tree.leaves(out), jax.tree.leaves(result), strict=True):
                rows[place] = found[: math.prod(shape)].reshape(shape)
            with lock:
                done[0] += tally(result.code[: math.prod(shape)])
                on_progress(done[0])

        if pieces:
            deal(pieces[0])  # compiles, once
        # All missions are played by other threads: an interrupt here must not leave a program running.
        with ThreadPoolExecutor(cores()) as pool:
            try:
                list(pool.map(play, pieces))
            except BaseException:
                stop.set()  # nor wait for all queues
                pool.shutdown(cancel_futures=True)
                raise
        return out


def objective(result: Result, penalty: float) -> Float[np.ndarray, "*S"]:
    """Seconds of each mission: its time if it reached the goal, `penalty` if it failed, and never more than that.

    Its mean is the penalised average run time by which solvers that may fail are compared.
    """
    time = np.minimum(result.time.astype(float), penalty)
    return np.where(result.code == Code.REACHED, time, penalty)
