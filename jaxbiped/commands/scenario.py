"""Check every query of a Moving AI scenario against the file's optimal length."""

from __future__ import annotations

import csv
import io
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from jaxtyping import Float64, Int
from rich.console import Console
from rich.progress import Progress

from jaxbiped.commands.map_source import MapSource
from jaxbiped.core.class_grid import ClassGrid
from jaxbiped.devices import cores
from jaxbiped.errors import InputError
from jaxbiped.files import new_folder, write_whole
from jaxbiped.formats.moving_ai import load_scenario
from jaxbiped.mapping.grid import Cell
from jaxbiped.planning import Costs, PathSearch, Rules

OCTILE = Costs(1.0, 0.0, 0.0, 0.0, 0.0)  # a straight move 1, a diagonal one sqrt(2), and nothing else
ROUNDING = 1e-6  # relative error of a length in float32: below 0.005 cells up to 5,000, the least by which octile
# lengths of one query differ in practice (99 straight moves for 70 diagonal ones)
LISTED = 10  # queries that differ, printed one by one
DIFFER = 1  # exit status


def lengths(
    grid: ClassGrid, start_ij: Int[np.ndarray, "Q 2"], goal_ij: Int[np.ndarray, "Q 2"], show: bool = False
) -> Float64[np.ndarray, "Q"]:
    """Octile length [cells] of each query, inf where there is no path; one search each, on all cores.

    Args:
      grid: the map.
      start_ij, goal_ij: cells.
      show: draw a progress bar.

    Lengths are exact up to a relative error of `ROUNDING`; corners are never cut.
    """
    found = np.full(len(goal_ij), np.inf)
    queues = [np.arange(first, len(found), cores()) for first in range(cores())]
    with Progress(console=Console(stderr=True), transient=True, disable=not show) as bar:
        task = bar.add_task("queries", total=len(found))

        def work(queue: Int[np.ndarray, "q"]) -> None:
            search = PathSearch(grid.classes, grid.levels, OCTILE, Rules(corner_cutting=False))
            for q in queue:
                found[q] = search.cost(start_ij[q], goal_ij[q])
                bar.advance(task)

        with ThreadPoolExecutor(cores()) as pool:
            list(pool.map(work, queues))
    return found


def check_scenario(source: MapSource, path: Path, sample: int | None, out: Path) -> int:
    """Compare each query with the planner, write all of them to `out`/queries.csv, and print how many agree.

    Args:
      source: the map.
      path: the scenario.
      sample: check only this many queries, evenly spread.
      out: a folder that does not exist.

    Returns:
      Exit status: 0 if all agree, 1 if any differs.

    Raises:
      InputError: the map is not a Moving AI map, a bad scenario, or `out` cannot be written.
    """
    if not source.in_cells:
        raise InputError("goes with a Moving AI .map only", file=source.file, field="scenario", value=str(path))
    scenario = load_scenario(path, source.grid)
    count = len(scenario.optimal)
    picked = np.unique(np.linspace(0, count - 1, min(sample or count, count)).round().astype(int))
    start, goal, optimal = scenario.start_ij[picked], scenario.goal_ij[picked], scenario.optimal[picked]
    began = time.perf_counter()
    found = lengths(source.grid, start, goal, show=True)
    seconds = time.perf_counter() - began
    slack = scenario.tolerance[picked] + ROUNDING * optimal
    equal = np.abs(found - optimal) <= slack
    rows = [
        [int(b), int(s[1]), int(s[0]), int(g[1]), int(g[0]), float(o), f"{f:.9g}", bool(e)]
        for b, s, g, o, f, e in zip(scenario.bucket[picked], start, goal, optimal, found, equal, strict=True)
    ]
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["bucket", "start_x", "start_y", "goal_x", "goal_y", "optimal", "found", "equal"])
    table.writerows(rows)
    with new_folder(out) as folder:
        write_whole(folder / "queries.csv", lambda file: file.write(text.getvalue().encode()))
    print(f"map       {source.file}: {source.grid.shape[1]} x {source.grid.shape[0]} cells")
    print(f"scenario  {path}: {len(picked)} of {count} queries, in {seconds:.1f} s including compilation")
    print(f"equal     {int(equal.sum())} of {len(picked)} optimal lengths")
    wrong = [row for row in rows if not row[-1]]
    for bucket, sx, sy, gx, gy, best, got, _ in wrong[:LISTED]:
        off_ground = Cell.OBSTACLE in source.grid.classes[[sy, gy], [sx, gx]]
        why = "; an end is water, trees or out of bounds" if off_ground else ""
        print(f"differs   bucket {bucket}, ({sx}, {sy}) to ({gx}, {gy}): file {best:.9g}, found {got}{why}")
    if len(wrong) > LISTED:
        print(f"          and {len(wrong) - LISTED} more")
    print(f"written   {out}: queries.csv")
    return DIFFER if wrong else 0
