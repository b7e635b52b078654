"""A sweep of 64 cost vectors x 1,024 arenas x 2 strategies in one compiled program: where its time goes.

    python -m sweeps.benchmarks.sweep            # about 131,000 missions
    python -m sweeps.benchmarks.sweep --quick    # 8 vectors x 64 arenas

The closed loop with the ray-cast camera, on costs C1 to C4 spread evenly by the logarithm around the paper's. Printed:
how many programs of the loop were compiled, and then, with nothing left to compile, the share of the time that is
spent in compiled code (the queues', each on its own core, and those that draw arenas and plan with perfect knowledge),
the store's share, and how busy both cores were.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import threading
import time
from pathlib import Path

import jax

from jaxbiped.devices import cores
from jaxbiped.mission import batched_driver
from jaxbiped.study import evaluation, store
from jaxbiped.study.clock import CompileClock
from jaxbiped.study.run_study import table
from jaxbiped.study.sweep import SweepConfig


class Stopwatch:
    """Seconds spent in functions, over all threads."""

    def __init__(self):
        self.seconds, self.lock = 0.0, threading.Lock()

    def timed(self, function):
        """The function, until its results are there, timed."""

        def run(*arguments, **options):
            begin = time.perf_counter()
            result = jax.block_until_ready(function(*arguments, **options))
            with self.lock:
                self.seconds += time.perf_counter() - begin
            return result

        return run


class TimedPrograms(dict):
    """`queue.COMPILED`, whose programs are timed."""

    def __init__(self, watch: Stopwatch):
        self.watch = watch

    def __setitem__(self, key, programs):
        super().__setitem__(key, tuple(self.watch.timed(program) for program in programs))


def costs(vectors: int, arenas: int) -> SweepConfig:
    """The sweep."""
    around = {"costs.c1": (0.25, 4), "costs.c2": (1.25, 20), "costs.c3": (2.5, 40), "costs.c4": (25, 400)}
    sobol = {"points": vectors, "log_range": around}
    return SweepConfig(arenas=arenas, shard=arenas, strategies=("bump_aware", "floor_only"), sobol=sobol)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vectors", type=int, default=64, help="a power of 2")
    parser.add_argument("--arenas", type=int, default=1024)
    parser.add_argument("--quick", action="store_true", help="8 vectors x 64 arenas")
    options = parser.parse_args()
    config = costs(*((8, 64) if options.quick else (options.vectors, options.arenas)))
    clock, loops, others, writing = CompileClock(), Stopwatch(), Stopwatch(), Stopwatch()
    batched_driver.COMPILED = TimedPrograms(loops)
    compile_all(config)
    compiling, programs = clock.seconds, len(batched_driver.COMPILED)
    print(f"{programs} program of the closed loop compiled, {compiling:.0f} s of compiling in all", flush=True)
    evaluation.draw, evaluation.oracle_plan = others.timed(evaluation.draw), others.timed(evaluation.oracle_plan)
    loops.seconds = 0.0
    points = tuple(config.points())
    with tempfile.TemporaryDirectory() as place:
        begin, begin_cpu = time.perf_counter(), time.process_time()
        header = store.StudyHeader(config, seed=0, arenas=config.arenas, points=table(points))
        with store.create(Path(place) / "r", header) as results:
            append = writing.timed(results.append)
            for shard, frame in evaluation.evaluate(config, points=points):
                append(frame, shard.number, compile_time=0.0)
            rows = writing.timed(results.finish)(compile_time=0.0).rows
    wall, cpu = time.perf_counter() - begin, time.process_time() - begin_cpu
    inside = loops.seconds / cores() + others.seconds
    print(f"{len(points)} cost vectors x {config.arenas} arenas x 2 strategies: {rows} missions in {wall:.1f} s")
    print(
        f"  compiled meanwhile: {len(batched_driver.COMPILED) - programs} programs, {clock.seconds - compiling:.1f} s"
    )
    print(f"  {rows / wall:.0f} missions/s; {cpu / wall:.2f} of {cores()} cores busy")
    print(f"  in compiled code: {100 * inside / wall:.1f} % of the time")
    print(f"    queues {loops.seconds / cores():.1f} s on each core, others {others.seconds:.1f} s")
    print(f"  store: {writing.seconds:.2f} s, {100 * writing.seconds / wall:.2f} % of the time")
    print(f"  peak memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20:.2f} GiB")


def compile_all(config: SweepConfig) -> None:
    """Compile everything, on missions of one decision: their number is traced."""
    limits = config.mission.limits.model_copy(update={"max_decisions": 1})
    mission = config.mission.model_copy(update={"limits": limits})
    short = config.model_copy(update={"mission": mission})
    for _ in evaluation.evaluate(short, points=tuple(short.points())):
        pass


if __name__ == "__main__":
    main()
