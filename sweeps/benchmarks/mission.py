"""Speed of the closed loop: missions a second against the same loop in plain NumPy and heapq, one arena at a time.

    python -m sweeps.benchmarks.mission            # ratio to the reference, and microseconds of each part
    python -m sweeps.benchmarks.mission --stream   # peak memory while arenas stream through: it must not grow
    python -m sweeps.benchmarks.mission --sweep    # compilations of a sweep over 64 cost vectors: none after the first

Both sides use the whole machine, with two threads and two processes, on the same arenas and strategies; compile time
is apart. The compiled side works the list of missions off several times over, as a study has many.

Measured on two virtual cores of an AMD EPYC, jax 0.10.2, with little other load:
  compiled 666 missions/s (15,050 decisions/s) against 12.6 of the reference: ratio 53, by rounds 52 to 53, 53 by CPU
  seconds. The same code and number of decisions in all of 100 missions. 19 s of compiling.
  A decision, each part alone: sense 28 us, map 62, plan 4, select 6, execute 6. The reference: 3.4 ms, 2.8, 1.5, and
  0.5 for the last two.
  --stream: 2,048 arenas in shards of 1,024 peak at 2.88 GiB, 8,192 at 2.90 GiB.
  --sweep: 28 traces and 27 compilations for the first cost vector, none for the 64 that follow.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import resource
import time
from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped import planning
from jaxbiped.arenas.families import FAMILIES, SIZE_X, SIZE_Y
from jaxbiped.core.names import STRATEGIES
from jaxbiped.devices import cores
from jaxbiped.executors.kinematic_executor import kinematic
from jaxbiped.mission import decision
from jaxbiped.mission.arena_batch import draw
from jaxbiped.mission.batched_driver import SLOTS, stack
from jaxbiped.mission.goal import goal_cell
from jaxbiped.mission.mission_step import apply_outcome, sense, step
from jaxbiped.mission.params import MissionConfig, mission_spec
from jaxbiped.mission.route import nearest_direction
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.state import start
from jaxbiped.study.clock import CompileClock
from jaxbiped.study.config import StudyConfig
from jaxbiped.study.evaluation import evaluate
from jaxbiped.study.queues import run_all
from jaxbiped.study.workload import Workload
from tests.reference import mission as reference

CONFIG = MissionConfig()
SPEC = mission_spec(CONFIG, (SIZE_X, SIZE_Y))
MISSIONS = 2400  # that the compiled side is timed on, at least


def points():
    """All strategies' parameters, [P]."""
    return stack([CONFIG.params(name) for name in STRATEGIES])


def row(tree, index):
    """Row `index` of every leaf."""
    return jax.tree.map(lambda leaf: leaf[index], tree)


def compiled_side(arenas: int):
    """A function that works off the list of missions, several times over: results [P, arenas * copies]."""
    copies = -(-MISSIONS // (arenas * len(STRATEGIES)))
    batch, seeds = draw(jax.random.key(0), jnp.tile(jnp.arange(arenas), copies), FAMILIES)
    workload = Workload(batch, seeds, points(), len(seeds), SPEC)
    return lambda: run_all(workload, lambda ended: None)


def play_one(arena, setting, seed):
    """One mission of the reference: code, decisions, CPU seconds."""
    begin = time.process_time()
    mission = reference.run(arena, setting, seed, SPEC)
    return mission.code, mission.decisions, time.process_time() - begin


def missions_of(arenas: int):
    """The list of missions: arena, parameters, seed; strategy by strategy."""
    batch, seeds = jax.device_get(draw(jax.random.key(0), jnp.arange(arenas), FAMILIES))
    params = points()
    return [(row(batch, k), row(params, p), seeds[k]) for p in range(len(STRATEGIES)) for k in range(arenas)]


def pool_of_references():
    """A process a core, of one thread each: more would get in each other's way."""
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"
    return multiprocessing.get_context("spawn").Pool(cores())


def timed(function, *arguments, **options):
    """(result, seconds)."""
    begin = time.perf_counter()
    return function(*arguments, **options), time.perf_counter() - begin


def parts(repeats: int = 20):
    """Print microseconds a decision of each part, on one full set of slots in the middle of its missions."""
    batch, seeds = draw(jax.random.key(0), jnp.arange(SLOTS), FAMILIES)
    setting = jax.tree.map(lambda leaf: jnp.asarray(leaf)[jnp.arange(SLOTS) % len(STRATEGIES)], points())
    setup = MissionSetup(batch, setting, SPEC)
    world, agent = jax.vmap(start)(setup, seeds)
    turn = jax.jit(step)
    for _ in range(6):
        world, agent, *_ = turn(world, agent, setup)
    grid = SPEC.grid
    costs, rules = setting.costs.at_pitch(grid.pitch), setting.strategy.rules()

    def plan(local, goal_ij):
        cost = planning.field(local.classes, local.levels, costs, rules, goal_ij).cost
        heading = jax.vmap(nearest_direction)(local.pose.yaw)
        return planning.next_step(cost, local.classes, local.levels, costs, rules, local.ij, heading)

    def execute(world, agent, command, verdict):
        done = jax.vmap(kinematic)(batch, world, command, setting)
        return jax.vmap(apply_outcome)(world, agent, command, verdict, done, setup)

    def part(name, function, *arguments):
        run = jax.jit(function)
        result = jax.block_until_ready(run(*arguments))
        taken = min(timed(lambda: jax.block_until_ready(run(*arguments)))[1] for _ in range(repeats))
        print(f"  {name:8s} {taken / SLOTS * 1e6:7.1f} us a decision")
        return result

    print(f"parts, {SLOTS} missions at once, each alone, in memory that is new at each call:")
    measure = jax.vmap(partial(sense, body_pose=None))
    view, sightings = part("sense", measure, world, agent, setup)
    agent, local = part("map", decision.perceive, agent, view, sightings, setup)
    goal_ij = jax.vmap(partial(goal_cell, grid=grid))(
        batch.goal_xy, setting.limits.goal_radius, local.classes, setting.strategy.rules()
    )
    moves = part("plan", plan, local, goal_ij)
    agent, command, verdict = part("select", jax.vmap(decision.choose), agent, view, local, goal_ij, moves, setup)
    part("execute", execute, world, agent, command, verdict)
    part("all", step, world, agent, setup)


def reference_parts(arenas: int = 6) -> None:
    """Print the same of the reference, in this process, over whole missions."""
    spent = {"sense": 0.0, "map": 0.0, "plan": 0.0, "all": 0.0}
    places = (
        ("sense", reference.sensing, "measure_raycast"),
        ("sense", reference.sensing, "sight_landmarks"),
        ("map", reference, "perceive"),
        ("plan", reference, "plan"),
        ("all", reference, "cycle"),
    )

    def metered(part, function):
        def run(*arguments):
            result, taken = timed(function, *arguments)
            spent[part] += taken
            return result

        return run

    for part, module, name in places:
        setattr(module, name, metered(part, getattr(module, name)))
    decisions = sum(play_one(*mission)[1] for mission in missions_of(arenas))
    spent["select and execute"] = 2 * spent["all"] - sum(spent.values())
    print("parts of the reference:")
    for part, taken in spent.items():
        print(f"  {part:8s} {taken / decisions * 1e6:7.0f} us a decision")


def compare(arenas: int, repeats: int) -> None:
    """Print the ratio and what it is made of. The sides take turns, and the fastest run of each counts."""
    clock, run, tasks = CompileClock(), compiled_side(arenas), missions_of(arenas)
    _, first = timed(run)
    compiling, fast, slow, fast_cpu, slow_cpu = clock.seconds, [], [], [], []
    with pool_of_references() as pool:
        pool.starmap(play_one, tasks[: 4 * cores()], chunksize=1)  # imports are not counted
        for _ in range(repeats):
            begin = time.process_time()
            result, taken = timed(run)
            fast_cpu.append(result.code.size / (time.process_time() - begin))
            fast.append(result.code.size / taken)
            outcomes, taken = timed(pool.starmap, play_one, tasks, chunksize=1)
            slow_cpu.append(len(tasks) / sum(cpu for *_, cpu in outcomes))
            slow.append(len(tasks) / taken)
    codes, turns, _ = np.array(outcomes).T
    for name, rates in (("compiled", fast), ("reference", slow)):
        print(f"{name:10s} {max(rates):7.2f} missions/s, {max(rates) * turns.mean():8.1f} decisions/s")
    rounds = ", ".join(f"{f / s:.0f}" for f, s in zip(fast, slow, strict=True))
    print(f"ratio: {max(fast) / max(slow):.0f}, by rounds {rounds}")
    print(f"ratio by CPU seconds, which a busy machine disturbs less: {max(fast_cpu) / max(slow_cpu):.0f}")
    print(f"apart: first run {first:.1f} s for {result.code.size} missions, of which {compiling:.1f} s of compiling")
    same = codes == result.code[:, :arenas].ravel()
    same &= turns == result.decisions[:, :arenas].ravel()
    print(f"same code and number of decisions: {same.mean():.1%} of {len(tasks)} missions")


def peak_memory(arenas: int, shard: int) -> float:
    """Greatest resident memory [GiB] of this process after so many arenas have streamed through."""
    config = StudyConfig(arenas=arenas, shard=shard, strategies=("full", "blind_stop"))
    for _ in evaluate(config):
        pass
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


def stream(shard: int, shards: tuple[int, ...]) -> None:
    """Print peak memory for several numbers of arenas, each in a fresh process."""
    for count in shards:
        begin = time.perf_counter()
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            peak = pool.apply(peak_memory, (count * shard, shard))
        taken = time.perf_counter() - begin
        print(f"{count * shard:7d} arenas in shards of {shard}: peak {peak:.2f} GiB, {taken:.0f} s", flush=True)


def sweep(vectors: int = 64, arenas: int = 8) -> None:
    """Print how often JAX traced and compiled, before and during a sweep over cost vectors."""
    events = []
    jax.monitoring.register_event_duration_secs_listener(lambda event, *_, **__: events.append(event))
    batch, seeds = draw(jax.random.key(0), jnp.arange(arenas), FAMILIES)
    rng, setting, seen = np.random.default_rng(0), CONFIG.params("full"), set()

    def counted():
        return tuple(sum(kind in event for event in events) for kind in ("jaxpr_trace", "backend_compile"))

    for k in range(vectors + 1):
        costs = planning.Costs(*(jnp.float32(c) for c in rng.uniform(0.1, 30, 5)))
        point = stack([replace(setting, costs=costs)])
        result = run_all(Workload(batch, seeds, point, arenas, SPEC), lambda ended: None)
        seen.add(float(result.time.sum()))
        if k == 0:
            warm = counted()
            print(f"first cost vector: {warm[0]} traces, {warm[1]} compilations")
    more = tuple(after - before for after, before in zip(counted(), warm, strict=True))
    print(f"{vectors} further cost vectors: {more[0]} traces, {more[1]} compilations; {len(seen)} different outcomes")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arenas", type=int, default=20, help="arenas, each under all strategies, on both sides")
    parser.add_argument("--repeats", type=int, default=3, help="rounds; the fastest of each side counts")
    parser.add_argument("--stream", action="store_true")
    parser.add_argument("--shard", type=int, default=1024)
    parser.add_argument("--shards", type=int, nargs="+", default=[2, 8])
    parser.add_argument("--sweep", action="store_true")
    options = parser.parse_args()
    if options.stream:
        stream(options.shard, tuple(options.shards))
    elif options.sweep:
        sweep()
    else:
        compare(options.arenas, options.repeats)
        parts()
        reference_parts()


if __name__ == "__main__":
    main()
