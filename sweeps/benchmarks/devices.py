"""Planning on two CPU devices against one, each device with a core of its own.

    python -m sweeps.benchmarks.devices

`planning.field(..., devices=...)` on the same class grids, by a process with one device that may use one core, and by
one with two devices on two cores. Beside it stands what the machine itself gives: a loop in Numba that hardly touches
memory, in one process on one core, and in two at once. Virtual cores can be two threads of one real core, or
be shared with others; no program gains more on a second one than that loop does. All are timed in turns.

Measured on two virtual cores of an AMD EPYC, jax 0.10.2, with little other load: two devices are 2.4 times as fast as
one by the least of each, 2.1 by the median of rounds (1.3 to 2.5), where the busy loop gains 2.0. They take 0.77
times the CPU seconds of one. Beside busy processes the same command said anything from 1.1 to 1.8, and the busy loop
1.0 to 1.4.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time

ROUNDS = 12
BATCH, SHAPE = 16384, (28, 36)
TURNS = 100_000_000  # of the busy loop


def spinning():
    """The busy loop, ready to run."""
    import numba

    @numba.njit
    def spin(turns):
        state = 1
        for _ in range(turns):
            state ^= state << 13
            state ^= state >> 7
            state ^= state << 17
        return state

    return lambda: spin(TURNS)


def planning_on(devices: int):
    """Planning on a batch that lies on the devices, ready to run."""
    import jax
    import numpy as np

    from jaxbiped import planning
    from jaxbiped.devices import EACH, mesh_of, placed

    rng = np.random.default_rng(0)
    classes = rng.choice(np.array([0, 1, 1, 1, 1, 1, 2, 3, 4], np.int8), (BATCH, *SHAPE))
    goals = np.stack([rng.integers(0, size, BATCH) for size in SHAPE], 1).astype(np.int32)
    used = jax.local_devices()
    assert len(used) == devices
    classes, levels, goals = placed((classes, (classes == 2).astype(np.int8), goals), mesh_of(used), EACH)
    return lambda: jax.block_until_ready(planning.field(classes, levels, goal_ij=goals, devices=used))


def child(job: str, cores: list[int]) -> None:
    """Do a job each time that a line comes in, and say the seconds that it took, and those of all cores."""
    os.sched_setaffinity(0, cores)
    os.environ["XLA_FLAGS"] = f"--xla_force_host_platform_device_count={len(cores)}"
    action = spinning() if job == "spin" else planning_on(len(cores))
    action()
    print("ready", flush=True)
    for _ in sys.stdin:
        begin, spent = time.perf_counter(), time.process_time()
        action()
        print(time.perf_counter() - begin, time.process_time() - spent, flush=True)


def start(job: str, cores: list[int]) -> subprocess.Popen:
    """A child, ready."""
    argv = [sys.executable, __file__, "--child", job, "--cores", *map(str, cores)]
    running = subprocess.Popen(argv, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert running.stdout.readline() == "ready\n"
    return running


def timed(*children: subprocess.Popen) -> tuple[float, float]:
    """Seconds until all of them, begun together, have done their job once; and the most CPU seconds of one."""
    for running in children:
        running.stdin.write("go\n")
        running.stdin.flush()
    seconds = [[float(word) for word in running.stdout.readline().split()] for running in children]
    return max(wall for wall, _ in seconds), max(cpu for _, cpu in seconds)


def report(name: str, unit: float, one: list[float], two: list[float], words: str) -> float:
    """Print the least of each, and the speedup of two; `two` are seconds for twice the work of `one`, or the same."""
    best, rounds = min(one) / min(two), sorted(a / b for a, b in zip(one, two, strict=True))
    spread = f"by rounds {rounds[0]:.2f} to {rounds[-1]:.2f}, median {rounds[ROUNDS // 2]:.2f}"
    print(f"{name}: {min(one) * unit:.2f} and {min(two) * unit:.2f} {words}")
    print(f"  {best:.2f} times as fast on two; {spread}")
    return best


def main() -> None:
    """Run the bench."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--child", choices=("spin", "plan"))
    parser.add_argument("--cores", type=int, nargs="+")
    args = parser.parse_args()
    if args.child:
        return child(args.child, args.cores)
    if not hasattr(os, "sched_setaffinity"):
        sys.exit("this needs a system that pins processes to cores, such as Linux")
    cores = sorted(os.sched_getaffinity(0))[:2]
    if len(cores) < 2:
        sys.exit("this needs two cores")
    spins = [start("spin", [core]) for core in cores]
    one, two = start("plan", cores[:1]), start("plan", cores)
    times: dict[str, list[float]] = {name: [] for name in ("spin", "spins", "one", "two", "cpu one", "cpu two")}
    for _ in range(ROUNDS):
        times["spin"].append(timed(spins[0])[0])
        times["spins"].append(timed(*spins)[0] / 2)  # for half of the work that they do
        for name, running in (("one", one), ("two", two)):
            wall, cpu = timed(running)
            times[name].append(wall)
            times[f"cpu {name}"].append(cpu)
    for running in (*spins, one, two):
        running.stdin.close()
        running.wait()
    ceiling = report("busy loop, one process and two", 1e3, times["spin"], times["spins"], "ms each")
    words = f"us a map, {BATCH} maps of {SHAPE[0]} x {SHAPE[1]}"
    gain = report("planning, one device and two", 1e6 / BATCH, times["one"], times["two"], words)
    more = min(times["cpu two"]) / min(times["cpu one"])
    print(f"  {more:.2f} times the CPU seconds on two, which other load on the machine changes least")
    print(f"planning gains {gain / ceiling:.0%} of what the machine gives")


if __name__ == "__main__":
    main()
