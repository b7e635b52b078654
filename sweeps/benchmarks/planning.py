"""Planning against its peers, both sides on all cores, compile time apart.

    python -m sweeps.benchmarks.planning [--quick]      (needs the extra `bench`: pyastar2d)

Peers: pyastar2d (compiled A*, one path a call) and scipy's compiled Dijkstra (a whole field), each in a pool of
one process a core, handed their maps in large pieces. What is compared is not quite the same work, to the
peers' advantage: pyastar2d knows weights of cells only, so that it plans without bump edges and corner rules,
and finds one path, not the field; scipy is timed with its graph already built, the time to build one is shown
apart. Ours starts from class grids and ends with the field and the next step of every arena. Each figure is
the least of several repeats, taken in turns, so that other load on the machine meets all sides alike.

Measured on 2 virtual cores of an AMD EPYC (AVX-512, 1 MiB L2 a core), jax 0.10.2, numba 0.68.1, with little other
load; busy processes move the ratios by a third. "x" is the peer's time over ours.
4,096 maps of 28 x 36, 3.1 us a map: 5.7x pyastar2d, 19x Dijkstra, 55x Dijkstra and its graph. 512 maps of 140 x 180,
101 us: 3.1x, 15x, 40x. One map of 512 x 512: open 1.2x, rooms 1.3x, maze 0.82x, maze with loops 0.79x, cells thrown at
random 1.1x. The first call compiles for 3 to 6 s, most of it in Numba.
"""

from __future__ import annotations

import argparse
import os
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse
from scipy.sparse.csgraph import dijkstra

from jaxbiped import planning
from jaxbiped.mapping.grid import Cell
from jaxbiped.planning.host_planner import HostPlanner
from jaxbiped.planning.planners import Problem

COSTS, RULES = planning.Costs(), planning.Rules()
WEIGHTS = np.array([100.0, 2.0, 6.0, 6.0, np.inf], np.float32)  # of a cell of each class, for pyastar2d


def random_maps(rng, batch, height, width):
    """Classes, levels, start and goal of maps with boxes of each class, a few cells to half the map wide."""
    classes = np.full((batch, height, width), Cell.FLOOR, np.int8)
    scale = min(height, width) / 28
    kinds = ((Cell.UNMEASURED, 3, 14, 4), (Cell.BUMP, 2, 12, 3), (Cell.GATE, 2, 7, 3), (Cell.OBSTACLE, 2, 8, 10))
    ends = np.zeros((2, batch, 2), int)
    for b, grid in enumerate(classes):
        for kind, low, high, most in kinds:
            for _ in range(rng.integers(0, most)):
                size = rng.integers(int(low * scale), int(high * scale) + 1, 2)
                i, j = rng.integers(0, (height - size[0], width - size[1]))
                grid[i : i + size[0], j : j + size[1]] = kind
        free = np.argwhere(grid != Cell.OBSTACLE)
        ends[:, b] = free[rng.integers(len(free), size=2)]
    return classes, (classes == Cell.BUMP).astype(np.int8), ends[0], ends[1]


def open_map(rng, size):
    return np.full((size, size), Cell.FLOOR, np.int8)


def rooms(rng, size, room=32):
    """Square rooms with a door of two cells to each neighbour."""
    classes = open_map(rng, size)
    classes[::room], classes[:, ::room] = Cell.OBSTACLE, Cell.OBSTACLE
    for i in range(0, size, room):
        for j in range(0, size, room):
            a, b = rng.integers(4, room - 4, 2)
            classes[i, j + a : j + a + 2] = classes[i + b : i + b + 2, j] = Cell.FLOOR
    classes[1, 1] = Cell.FLOOR
    return classes


def maze(rng, size, loops=0):
    """Corridors of one cell, dug depth first: the least paths wind through all of the map."""
    passable = np.zeros((size, size), bool)
    passable[1, 1], stack = True, [(1, 1)]
    while stack:
        i, j = stack[-1]
        ways = [(a, b) for a, b in ((0, 2), (2, 0), (0, -2), (-2, 0)) if 0 < i + a < size and 0 < j + b < size]
        ways = [(a, b) for a, b in ways if not passable[i + a, j + b]]
        if not ways:
            stack.pop()
            continue
        a, b = ways[rng.integers(len(ways))]
        passable[i + a // 2, j + b // 2] = passable[i + a, j + b] = True
        stack.append((i + a, j + b))
    if loops:
        passable[rng.integers(1, size, loops), rng.integers(1, size, loops)] = True
    return np.where(passable, Cell.FLOOR, Cell.OBSTACLE).astype(np.int8)


def loopy_maze(rng, size):
    """The same with a wall in fifty broken."""
    return maze(rng, size, loops=size * size // 50)


def noise(rng, size):
    """Cells of any class thrown at random: no real map, the worst order for any list."""
    classes = rng.choice(5, p=[0.1, 0.5, 0.1, 0.1, 0.2], size=(size, size)).astype(np.int8)
    classes[1, 1] = Cell.FLOOR
    return classes


def graph(edges):
    """Edge costs [8, H, W] of one arena as scipy wants them, from each cell to those that can move into it."""
    _, height, width = edges.shape
    k, i, j = np.nonzero(np.isfinite(edges))
    there = (i + planning.DIRECTIONS[k, 0]) * width + j + planning.DIRECTIONS[k, 1]
    return scipy.sparse.csr_array((edges[k, i, j].astype(float), (there, i * width + j)), shape=(height * width,) * 2)


def many_astar(job):
    import pyastar2d

    classes, start_ij, goal_ij = job
    for grid, start, goal in zip(classes, start_ij, goal_ij, strict=True):
        pyastar2d.astar_path(WEIGHTS[grid], tuple(start), tuple(goal), allow_diagonal=True)


def many_dijkstra(job):
    """Seconds of Dijkstra alone and with its graphs built, of one piece of maps."""
    classes, levels, goal_ij = job
    edges = np.asarray(planning.edge_costs(classes, levels))
    start = time.perf_counter()
    graphs = [graph(e) for e in edges]
    built = time.perf_counter()
    for one, goal in zip(graphs, goal_ij, strict=True):
        dijkstra(one, indices=goal[0] * classes.shape[2] + goal[1])
    return time.perf_counter() - built, time.perf_counter() - start


def timed(function, *args):
    start = time.perf_counter()
    out = function(*args)
    return time.perf_counter() - start, out


def ours(classes, levels, start_ij, goal_ij):
    field = planning.field(classes, levels, COSTS, RULES, goal_ij)
    heading = np.full(len(classes), -1)
    return jax.block_until_ready(planning.next_step(field.cost, classes, levels, COSTS, RULES, start_ij, heading))


def batches(pool, cores, height, width, batch, sample, repeats):
    """A batch of small maps; peers run on `sample` of them."""
    maps = random_maps(np.random.default_rng(0), batch, height, width)
    classes, levels, start_ij, goal_ij = (a[:sample] for a in maps)
    cuts = np.array_split(np.arange(sample), cores)
    first, _ = timed(ours, *maps)
    best = {"ours": np.inf, "astar": np.inf, "dijkstra": np.inf, "with graphs": np.inf}
    list(pool.map(many_dijkstra, [(classes[c[:1]], levels[c[:1]], goal_ij[c[:1]]) for c in cuts]))  # starts them
    for _ in range(repeats):
        best["ours"] = min(best["ours"], timed(ours, *maps)[0] / batch)
        seconds, _ = timed(lambda: list(pool.map(many_astar, [(classes[c], start_ij[c], goal_ij[c]) for c in cuts])))
        best["astar"] = min(best["astar"], seconds / sample)
        alone, whole = zip(*pool.map(many_dijkstra, [(classes[c], levels[c], goal_ij[c]) for c in cuts]), strict=True)
        best["dijkstra"] = min(best["dijkstra"], max(alone) / sample)
        best["with graphs"] = min(best["with graphs"], max(whole) / sample)
    print(f"{batch} maps of {height} x {width}: {best['ours'] * 1e6:.1f} us a map", end="")
    print(f" (first call, with compilation: {first:.1f} s)")
    for name, label in (("astar", "pyastar2d"), ("dijkstra", "scipy Dijkstra"), ("with graphs", "  and its graph")):
        print(f"  {label:16s} {best[name] * 1e6:9.1f} us a map, ratio {best[name] / best['ours']:6.1f}")


def singles(size, repeats):
    """One large map at a time, all from the corner."""
    print(f"one map of {size} x {size} at a time")
    for make in (open_map, rooms, maze, loopy_maze, noise):
        classes = make(np.random.default_rng(1), size)[None]
        levels, goal_ij = (classes == Cell.BUMP).astype(np.int8), np.array([[1, 1]])
        matrix = graph(np.asarray(planning.edge_costs(classes, levels))[0])

        def field(classes=classes, levels=levels, goal_ij=goal_ij):
            return jax.block_until_ready(planning.field(classes, levels, COSTS, RULES, goal_ij))

        def peer(matrix=matrix):
            return dijkstra(matrix, indices=size + 1)

        first, _ = timed(field)
        best = [np.inf, np.inf]
        for _ in range(repeats):
            seconds, out = timed(field)
            best[0] = min(best[0], seconds)
            seconds, exact = timed(peer)
            best[1] = min(best[1], seconds)
        exact, found = exact.reshape(size, size), np.asarray(out.cost[0])
        seen = np.isfinite(exact) & (exact > 0)
        error = np.max(np.abs(found[seen] - exact[seen]) / exact[seen])
        assert np.array_equal(np.isfinite(exact), np.isfinite(found)), make.__name__
        cell = 1e9 * best[0] / np.isfinite(exact).sum()
        print(
            f"  {make.__name__:11s} {best[0] * 1e3:7.1f} ms, {cell:3.0f} ns a cell, scipy {best[1] * 1e3:7.1f} ms",
            end="",
        )
        print(f", ratio {best[1] / best[0]:5.2f}, relative error {error:.0e}, first call {first:.1f} s")


def queries(size, count, repeats):
    """Paths on one map, one after the other: the first between opposite corners, the others between random cells."""
    import pyastar2d

    print(f"paths on one map of {size} x {size}, the map read once")
    for make in (open_map, rooms, maze, loopy_maze, noise):
        rng = np.random.default_rng(1)
        classes = make(rng, size)
        levels, free = (classes == Cell.BUMP).astype(np.int8), np.argwhere(classes != Cell.OBSTACLE)
        ends = np.concatenate([free[[0, -1]][None], free[rng.integers(len(free), size=(count, 2))]])
        first, _ = timed(lambda: planning.PathSearch(classes, levels).path(*ends[1]))  # noqa: B023
        read = min(timed(planning.PathSearch, classes, levels)[0] for _ in range(repeats))
        search, best = planning.PathSearch(classes, levels), np.full((2, len(ends)), np.inf)
        for _ in range(repeats):
            for q, (start, goal) in enumerate(ends):
                best[0, q] = min(best[0, q], timed(search.path, start, goal)[0])
                peer = timed(pyastar2d.astar_path, WEIGHTS[classes], tuple(start), tuple(goal), True)
                best[1, q] = min(best[1, q], peer[0])
        (corners, corners_peer), (ours, theirs) = best[:, 0] * 1e3, best[:, 1:].mean(1) * 1e3
        print(
            f"  {make.__name__:11s} corners {corners:6.2f} ms, ratio to pyastar2d {corners_peer / corners:5.1f}", end=""
        )
        print(f"; {count} others {ours:6.2f} ms each, ratio {theirs / ours:5.1f}", end="")
        print(f"; reading the map {read * 1e3:4.1f} ms, first call {first:.1f} s")


def plan_again(planner: HostPlanner, turns: int, problem: Problem) -> jax.Array:
    """Seconds [B] that the planner itself took in some turns of a loop; NaN where its path was refused."""

    def turn(_, seconds):
        route = planner.plan_batch(problem)
        return seconds + route.seconds + jnp.where(route.fault == 0, 0.0, jnp.nan)

    return jax.lax.fori_loop(0, turns, turn, jnp.zeros(len(problem.active)))


def host_planners(repeats: int = 50, count: int = 64, turns: int = 16) -> None:
    """What a planner on the host costs beside its own time, in a compiled loop: one that knows its path."""
    path = np.array([(14, 4), *((14 - k, 4 + k) for k in range(1, 5)), *((10, j) for j in range(9, 31))])
    ends = (np.tile(path[k], (count, 1)).astype(np.int32) for k in (0, -1))
    zeros = np.zeros(count, np.float32)
    costs, rules = (jax.tree.map(lambda v: np.full(count, v), given) for given in (COSTS, RULES))
    problem = jax.device_put(Problem(
        classes=np.full((count, 28, 36), Cell.FLOOR, np.int8), levels=np.zeros((count, 28, 36), np.int8),
        start_ij=next(ends), goal_ij=next(ends), heading=zeros.astype(np.int32), yaw=zeros, costs=costs, rules=rules,
        times=None, unit_seconds=zeros, surcharge=None, active=np.ones(count, bool),
    ))  # fmt: skip
    for kind, known in (("an array", path), ("a list of pairs", path.tolist())):
        plan = jax.jit(partial(plan_again, HostPlanner(lambda *_, known=known: known), turns))
        assert np.isfinite(plan(problem)).all()
        walls, own = [], []
        for _ in range(repeats):
            begun = time.perf_counter()
            seconds = jax.block_until_ready(plan(problem))
            walls.append((time.perf_counter() - begun) / turns)
            own.append(float(seconds.sum()) / turns)
        print(
            f"host planner, {len(path)} cells as {kind}: {1e6 * min(walls) / count:.0f} us a call"
            f" ({1e6 * min(own) / count:.0f} of them the call and its time limit)"
        )


def main():
    parser = argparse.ArgumentParser(description="Planning against compiled peers.")
    parser.add_argument("--quick", action="store_true", help="fewer maps and repeats: about half a minute")
    quick = parser.parse_args().quick
    cores = os.cpu_count()
    print(f"jax {jax.__version__} on {jax.default_backend()}, {cores} cores; ratio: peer's time over ours")
    with ProcessPoolExecutor(cores, mp_context=get_context("spawn")) as pool:
        if quick:
            batches(pool, cores, 28, 36, 1024, 256, 3)
            batches(pool, cores, 140, 180, 64, 16, 2)
            singles(256, 3)
            queries(256, 8, 2)
            host_planners()
        else:
            batches(pool, cores, 28, 36, 4096, 2048, 8)
            batches(pool, cores, 140, 180, 512, 128, 5)
            batches(pool, cores, 140, 180, 64, 64, 5)
            singles(256, 8)
            singles(512, 8)
            queries(512, 24, 3)
            host_planners()


if __name__ == "__main__":
    main()
