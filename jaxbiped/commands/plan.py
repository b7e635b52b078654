"""`jaxbiped plan`: a path on an existing map."""

from __future__ import annotations

import csv
import io
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from jaxbiped.commands.map_source import MapSource, open_map
from jaxbiped.commands.options.plan import PlanArgs
from jaxbiped.commands.scenario import check_scenario
from jaxbiped.config import config_hash, load
from jaxbiped.errors import InputError
from jaxbiped.files import new_folder, refuse_existing, write_whole
from jaxbiped.mapping.grid import Cell
from jaxbiped.motion.config import RobotConfig
from jaxbiped.planning import DIRECTIONS, Costs, PathSearch, Rules
from jaxbiped.terminal import legible

NO_PATH = 1  # exit status


@dataclass(frozen=True)
class Plan:
    """A path on a map, and its cost."""

    cells_ij: Int[np.ndarray, "n 2"]  # from start to goal
    costs: Float[np.ndarray, "n"]  # accumulated up to each cell
    length: float  # [cells] 1 straight, sqrt(2) diagonal
    turns: int  # changes of direction
    seconds: float  # [s] to read the map and to search the path, compiled
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


def find(
    source: MapSource, start_ij: tuple[int, int], goal_ij: tuple[int, int], costs: Costs, rules: Rules
) -> Plan | None:
    """The best path between two free cells, or None if there is none."""
    grid = source.grid
    search, first, seconds = timed(lambda: PathSearch(grid.classes, grid.levels, costs, rules))
    path, first_path, seconds_path = timed(lambda: search.path(start_ij, goal_ij))
    if path is None:
        return None
    return Plan(
        cells_ij=path.cells_ij,
        costs=path.so_far,
        length=float(np.hypot(*DIRECTIONS[path.directions].T.astype(float)).sum()),
        turns=int(np.count_nonzero(np.diff(path.directions))),
        seconds=seconds + seconds_path,
        compile_seconds=first + first_path - seconds - seconds_path,
    )


def timed(call):
    """(result, seconds of the first call, seconds of the second, which is compiled)."""
    seconds = []
    for _ in range(2):
        start = time.perf_counter()
        result = call()
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
