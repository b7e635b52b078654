"""How much time Eq. 1 gives away: the way of least cost against the way of least time, both known perfectly.

    python -m sweeps.studies.heading [--arenas N] [--seed S] [--strategy full]    (the bound)
    python -m sweeps.studies.heading --speed-only                                 (planning against scipy's Dijkstra)

On the true class grid of each random arena, the way that Eq. 1 chooses, with the paper's costs or with costs fitted to
the durations of the primitives (`jaxbiped tune --from-durations table`), is timed by the clock of a mission:
primitives, turns, measurements. So is the best way over (cell, heading), which no plan on the same grid can beat.
Arenas without a way are left out. The same in closed loop, with what robots see and how they walk:

    jaxbiped compare --strategies full --planner heading --out results/heading
    jaxbiped compare --strategies full --out results/cell
    jaxbiped compare results/heading results/cell
"""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse
import tyro
from rich.console import Console
from rich.table import Table
from scipy.sparse.csgraph import dijkstra

from jaxbiped import planning
from jaxbiped.arenas.families import FAMILIES, SIZE_X, SIZE_Y
from jaxbiped.geometry.pose import Pose
from jaxbiped.mapping import truth_grid
from jaxbiped.mission.arena_batch import draw
from jaxbiped.mission.goal import goal_cell
from jaxbiped.mission.params import MissionConfig, mission_spec
from jaxbiped.mission.plan_rollout import follow
from jaxbiped.mission.route import nearest_direction, pose_problem
from jaxbiped.motion.config import DurationConfig
from jaxbiped.motion.local_map import LocalMap
from jaxbiped.motion.selection import cell_of
from jaxbiped.planning.planners import GridPlanner, HeadingPlanner
from jaxbiped.statistics.intervals import mean_and_median, proportion
from jaxbiped.study.config import StrategyName
from jaxbiped.study.durations import fit
from sweeps.benchmarks.planning import random_maps

TOGETHER = 128  # arenas
SAME, WORTH = 0.01, 0.5  # [s]


@partial(jax.jit, static_argnames="spec")
def ways(batch, params, costs, spec):
    """Times [s] of the best way [A]; and [A, C + 2] of the way of each of the `costs`, and of following the planners.

    On true class grids.
    """
    grid, rules = spec.grid, params.strategy.rules()
    classes, levels = jax.vmap(truth_grid, in_axes=(0, None, None))(batch, grid, params.body)
    goal_ij = jax.vmap(goal_cell, in_axes=(0, None, 0, None, None))(
        batch.goal_xy, params.limits.goal_radius, classes, rules, grid
    )
    x, y, yaw = batch.start_xyyaw.T
    start_ij = jax.vmap(cell_of, in_axes=(0, 0, None))(x, y, grid)
    heading, length = jax.vmap(nearest_direction)(yaw), 3 * sum(grid.shape)
    begin = LocalMap(classes, levels, start_ij, Pose(x, y, jnp.zeros_like(x), yaw), grid)
    field = HeadingPlanner().field(pose_problem(begin, goal_ij, params, spec))
    best = planning.heading_path(field, start_ij, yaw, length)
    walked = [
        follow(begin, goal_ij, replace(params, planner=planner), spec) for planner in (HeadingPlanner(), GridPlanner())
    ]
    times = []
    for each in costs:
        each = each.at_pitch(grid.pitch)
        edges = planning.edge_costs(classes, levels, each, rules)
        to_go = planning.field(classes, levels, each, rules, goal_ij)
        way = planning.read_path(to_go, edges, start_ij, length, heading)
        times.append(planning.path_time(field.moves, field.turn, way, yaw))
    return jnp.where(best.valid, best.cost, jnp.inf), jnp.stack([*times, *walked], axis=1)


def bound(arenas: int, seed: int, strategy: str, console: Console) -> None:
    """Print how much longer the ways of Eq. 1 take than the best."""
    config = MissionConfig()
    spec = mission_spec(config, (SIZE_X, SIZE_Y))
    params = config.params(strategy)
    fitted = fit(DurationConfig(), measuring=True).costs
    costs = {
        "the paper's": planning.Costs(),
        "fitted": replace(planning.Costs(), **dict(zip(("c0", "c1", "c2", "c3"), map(float, fitted), strict=True))),
    }
    best, taken = [], []
    for first in range(0, arenas, TOGETHER):
        batch, _ = draw(jax.random.key(seed), first + jnp.arange(TOGETHER), FAMILIES)
        chunk = jax.device_get(ways(batch, params, tuple(costs.values()), spec))
        best.append(chunk[0])
        taken.append(chunk[1])
    best, taken = np.concatenate(best)[:arenas], np.concatenate(taken)[:arenas]
    family = np.array(FAMILIES)[np.arange(arenas) % len(FAMILIES)]
    columns = "costs", "family", "arenas", "best", "lost, mean", "median", "95 % of arenas", "worst", "none lost"
    table = Table(*columns, title=f"Time (s) of the way of Eq. 1 minus the best way's, {strategy}, seed {seed}")
    for number, name in enumerate(costs):
        for kind in ("all", *FAMILIES):
            chosen = np.isfinite(best) & ((family == kind) | (kind == "all"))
            table.add_row(name, kind, *row(best[chosen], taken[chosen, number], seed))
        table.add_section()
    console.print(table)
    by_time, by_cost = taken[:, -2], taken[:, -1]
    both = np.isfinite(by_time + by_cost)
    off, lost = by_time[both] - best[both], by_cost[both] - by_time[both]
    mean, _ = mean_and_median(lost, seed=seed)
    console.print(
        f"Walked on these maps, with the paper's costs, decision by decision, at real yaws: {np.sum(both):,} arrive by "
        f"both planners. A way by time takes {np.mean(off):+.1f} s against its plan (90 %: within "
        f"{np.quantile(np.abs(off), 0.9):.0f} s), and one by cost {mean.estimate:.1f}{span(mean)} s more "
        f"({100 * np.sum(lost) / np.sum(by_time[both]):.1f} %); it takes longer in {100 * np.mean(lost > WORTH):.0f} % "
        f"and less in {100 * np.mean(lost < -WORTH):.0f} %.",
        highlight=False,
        markup=False,
    )


def row(best, taken, seed) -> tuple[str, ...]:
    """Cells of the table."""
    lost = np.maximum(taken - best, 0.0)
    mean, median = mean_and_median(lost, seed=seed)
    equal = proportion(int(np.sum(lost < SAME)), len(lost))
    share = 100 * np.sum(lost) / np.sum(best)
    return (
        f"{len(lost):,}",
        f"{np.mean(best):.0f}",
        f"{mean.estimate:.1f}{span(mean)} ({share:.1f} %)",
        f"{median.estimate:.1f}{span(median)}",
        f"{np.quantile(lost, 0.95):.0f}",
        f"{np.max(lost):.0f}",
        f"{100 * equal.estimate:.0f} % [{100 * equal.low:.0f}, {100 * equal.high:.0f}]",
    )


def span(estimate) -> str:
    """Its interval, where it has one."""
    return "" if estimate.low is None else f" [{estimate.low:.1f}, {estimate.high:.1f}]"


def graph(time_of, face, turn):
    """Moves [8, H, W] of one arena and its turns as scipy wants them, from each state to those that lead into it."""
    _, height, width = face.shape
    cells = height * width
    k, i, j = np.nonzero(np.isfinite(time_of))
    at = face[k, i, j].astype(int) * cells
    there = at + (i + planning.DIRECTIONS[k, 0]) * width + j + planning.DIRECTIONS[k, 1]
    state = np.arange(8 * cells)
    heads = [there, (state + cells) % (8 * cells), state]
    tails = [at + i * width + j, state, (state + cells) % (8 * cells)]
    spent = [time_of[k, i, j].astype(float), np.full(8 * cells, turn), np.full(8 * cells, turn)]
    tails, heads, spent = (np.concatenate(parts) for parts in (tails, heads, spent))
    return scipy.sparse.csr_array((spent, (heads, tails)), shape=(8 * cells,) * 2)


def speed(maps: int, seed: int, console: Console) -> None:
    """Print CPU time a map of whole fields on 28 x 36, from class grids, and scipy's; the least of five rounds each."""
    classes, levels, _, goal_ij = random_maps(np.random.default_rng(seed), maps, 28, 36)
    solve = partial(planning.heading_field, classes, levels, goal_ij=goal_ij)
    field = jax.device_get(jax.block_until_ready(solve()))
    times, faces, cells = field.moves.time, field.moves.face, 28 * 36
    least = {"ours": np.inf, "graph": np.inf, "dijkstra": np.inf}
    few = range(min(maps, 32))
    for _ in range(5):
        started = time.process_time()
        jax.block_until_ready(solve())
        built = time.process_time()
        graphs = [graph(times[b], faces[b], 5.0) for b in few]
        made = time.process_time()
        found = []
        for b in few:
            goal = goal_ij[b, 0] * 36 + goal_ij[b, 1] + cells * np.arange(8)
            found.append(dijkstra(graphs[b], indices=goal, min_only=True))
        ended = time.process_time()
        spent = (built - started) / maps, (made - built) / len(few), (ended - made) / len(few)
        least = {name: min(old, new) for (name, old), new in zip(least.items(), spent, strict=True)}
    for b in few:
        np.testing.assert_allclose(field.cost[b].ravel(), found[b], rtol=1e-5)
    ours, scipy_graph, scipy_solve = (1e6 * value for value in least.values())
    console.print(f"{maps} maps of 28 x 36, eight headings: {ours:.0f} us of CPU time a map, moves and field.")
    console.print(
        f"scipy's Dijkstra: {scipy_solve:.0f} us, {scipy_solve / ours:.1f} times as long; with building its graph "
        f"{scipy_solve + scipy_graph:.0f} us, {(scipy_solve + scipy_graph) / ours:.1f} times."
    )


def main(arenas: int = 1200, seed: int = 0, strategy: StrategyName = "full", speed_only: bool = False) -> None:
    """See above.

    Args:
      arenas: how many; the first of the population that `jaxbiped compare` draws.
      speed_only: time planning, nothing else.
    """
    console = Console(width=150)
    if speed_only:
        speed(256, seed, console)
    else:
        bound(arenas, seed, strategy, console)


if __name__ == "__main__":
    tyro.cli(main)
