"""`jaxbiped plan`: a path on an existing map."""

from __future__ import annotations

import csv
import io
import time
from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np
from jaxtyping import Float, Int

from jaxbiped.commands.map_source import MapSource, open_map
from jaxbiped.commands.options.plan import PlanArgs
from jaxbiped.commands.scenario import check_scenario
from jaxbiped.config import config_hash, load
from jaxbiped.errors import InputError
from jaxbiped.files import new_folder, refuse_existing, write_whole
from jaxbiped.mapping.class_grid import ClassGrid
from jaxbiped.mapping.grid import Cell
from jaxbiped.motion.config import RobotConfig
from jaxbiped.planning import DIRECTIONS, Costs, Rules, edge_costs, field, next_step
from jaxbiped.terminal import legible

NO_PATH = 1  # exit status
MOVES_AT_ONCE = 256  # read from a field in one compiled call


@dataclass(frozen=True)
class Plan:
    """A path on a map, and its cost."""

    cells_ij: Int[np.ndarray, "n 2"]  # from start to goal
    costs: Float[np.ndarray, "n"]  # accumulated up to each cell
    length: float  # [cells] 1 straight, sqrt(2) diagonal
    turns: int  # changes of direction
    seconds: float  # [s] the field and the path, compiled
    compile_seconds: float  # [s] extra time of the first call


def main(args: PlanArgs) -> int:
    """Run the command: plan and write a folder, or check a scenario.

    Returns:
      Exit status: 0, or 1 if there is no path or the length of a query differs.

    Raises:
      InputError: options that do not go together, a bad map, start or goal outside the map or in an obstacle, a folder
        that exists or cannot be written. Nothing is left behind.
    """
    identity = args.model_copy(update={"out": None})
    out = args.out or Path("results") / f"plan-{config_hash(identity)}"
    refuse_existing(out)
    check_options(args)
    source = open_map(args.file, args.pitch, radius_of(args))
    if args.scenario is not None:
        return check_scenario(source, args.scenario, args.sample, out)
    start_ij = source.free_cell(args.start, "start")
    goal_ij = source.free_cell(args.goal, "goal")
    costs = Costs(args.c0, args.c1, args.c2, args.c3, args.c4).at_pitch(source.grid.pitch)
    plan = find(source, start_ij, goal_ij, costs, Rules(corner_cutting=args.corner_cutting))
    if plan is None:
        print(f"no path from {source.say(start_ij)} to {source.say(goal_ij)} on {args.file}")
        return NO_PATH
    with new_folder(out) as folder:
        write(source, plan, folder, args)
    report(source, plan, args)
    print(f"written   {out}: path.csv, path.npz, map.png")
    return 0


def radius_of(args: PlanArgs) -> float:
    """[m] by which obstacles grow."""
    if args.robot is None:
        return args.radius
    robot = load(RobotConfig, args.robot)
    if args.radius:
        raise InputError("does not go with --robot, whose radius is used", field="radius", value=args.radius)
    return robot.radius


def check_options(args: PlanArgs) -> None:
    """Raise `InputError` unless the options go together."""
    if args.scenario is None:
        for name in ("start", "goal"):
            if getattr(args, name) is None:
                raise InputError("must be given as X Y, unless --scenario is given", field=name)
        if args.sample is not None:
            raise InputError("goes with --scenario only", field="sample", value=args.sample)
        return
    for name in ("start", "goal", "c0", "c1", "c2", "c3", "c4", "corner_cutting", "radius", "robot"):
        if getattr(args, name) != PlanArgs.model_fields[name].default:
            message = "does not go with --scenario, whose lengths are octile and fix costs, corners and positions"
            raise InputError(message, field=name, value=getattr(args, name))


def solve(classes, levels, costs, rules, goal_ij):
    """Edge costs and cost-to-go of one map; not in one program, which makes the planner slower on large maps."""
    edges = jax.jit(edge_costs)(classes[None], levels[None], costs, rules)
    return edges[0], field(classes[None], levels[None], costs, rules, goal_ij).cost


steps = jax.jit(next_step, static_argnames="length")


def find(
    source: MapSource, start_ij: tuple[int, int], goal_ij: tuple[int, int], costs: Costs, rules: Rules
) -> Plan | None:
    """The best path between two free cells, or None if there is none.

    Raises:
      InputError: costs so different in size that float32 cannot distinguish the cells of the path.
    """
    grid = source.grid
    start, goal = np.array([start_ij], np.int32), np.array([goal_ij], np.int32)
    (edges, to_go), first, seconds = timed(lambda: solve(grid.classes, grid.levels, costs, rules, goal))
    if not np.isfinite(to_go[0][start_ij]):
        return None
    directions, first_read, seconds_read = timed(lambda: read(grid, to_go, costs, rules, start))
    cells = np.concatenate([start, start + np.cumsum(DIRECTIONS[directions], axis=0)])
    if tuple(cells[-1].tolist()) != goal_ij:
        message = "must not exceed the other costs by so much: single precision cannot resolve the path on this map"
        raise InputError(message, field="c4", value=float(costs.c4))
    prices = np.asarray(edges, np.float64)[directions, *cells[:-1].T]
    lengths = np.hypot(*DIRECTIONS[directions].T.astype(float))
    return Plan(
        cells_ij=cells,
        costs=np.concatenate([[0.0], np.cumsum(prices)]),
        length=float(lengths.sum()),
        turns=int(np.count_nonzero(np.diff(directions))),
        seconds=seconds + seconds_read,
        compile_seconds=first + first_read - seconds - seconds_read,
    )


def read(grid: ClassGrid, to_go, costs: Costs, rules: Rules, start_ij: Int[np.ndarray, "1 2"]) -> Int[np.ndarray, "n"]:
    """Directions of all moves of the path, read in slices, so that its length need not be known."""
    moves, ij, heading = np.zeros(0, np.int64), start_ij, np.array([-1], np.int32)
    while True:
        more = np.asarray(
            steps(to_go, grid.classes[None], grid.levels[None], costs, rules, ij, heading, length=MOVES_AT_ONCE)
        )[0]
        more = more[more >= 0].astype(np.int64)
        moves = np.concatenate([moves, more])
        if len(more) < MOVES_AT_ONCE:
            return moves
        ij, heading = start_ij + DIRECTIONS[moves].sum(0).astype(np.int32), more[-1:].astype(np.int32)


def timed(call):
    """(result, seconds of the first call, seconds of the second, which is compiled)."""
    seconds = []
    for _ in range(2):
        start = time.perf_counter()
        result = jax.block_until_ready(call())
        seconds.append(time.perf_counter() - start)
    return result, *seconds


def report(source: MapSource, plan: Plan, args: PlanArgs) -> None:
    """Print the result."""
    grid, moves = source.grid, len(plan.cells_ij) - 1
    count = {cell.name.lower(): int((grid.classes == cell).sum()) for cell in Cell}
    cells = ", ".join(f"{number} {name}" for name, number in count.items() if number)
    rows, columns = grid.shape
    print(f"map       {args.file}: {source.kind}, {columns} x {rows} cells of {grid.pitch:g} m ({cells})")
    print(f"from, to  {source.say(tuple(plan.cells_ij[0].tolist()))}, {source.say(tuple(plan.cells_ij[-1].tolist()))}")
    print(f"cost      {plan.costs[-1]:.6g}")
    print(f"length    {plan.length * grid.pitch:.3f} m, {plan.length:.3f} cells, {moves} moves, {plan.turns} turns")
    print(f"time      {plan.seconds * 1e3:.1f} ms, after {plan.compile_seconds:.1f} s to compile")


def write(source: MapSource, plan: Plan, folder: Path, args: PlanArgs) -> None:
    """Fill a folder with the path, as CSV and as npz, and a picture."""
    from jaxbiped.report import pictures  # loads matplotlib

    grid, cells = source.grid, plan.cells_ij
    xy = grid.centres_xy(cells)
    classes, levels = grid.classes[tuple(cells.T)], grid.levels[tuple(cells.T)]
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["row", "column", "x_m", "y_m", "class", "level", "cost"])
    for (i, j), (x, y), cell, level, cost in zip(cells, xy, classes, levels, plan.costs, strict=True):
        table.writerow([i, j, f"{x:.6g}", f"{y:.6g}", Cell(cell).name.lower(), level, f"{cost:.9g}"])
    write_whole(folder / "path.csv", lambda file: file.write(text.getvalue().encode()))
    arrays = {"cells_ij": cells, "xy": xy, "cost": plan.costs, "length_cells": plan.length, "pitch": grid.pitch}
    write_whole(folder / "path.npz", lambda file: np.savez_compressed(file, **arrays))
    pictures.save_map(
        folder / "map.png",
        grid,
        pictures.MapOverlay(plan_xy=xy, start_xy=tuple(xy[0]), goal_xy=tuple(xy[-1]), goal_radius=None),
        title=f"{legible(args.file.name)}: cost {plan.costs[-1]:.6g}, {plan.length * grid.pitch:.4g} m",
        axis=source.axis,
    )
