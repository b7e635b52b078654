"""Planners of other libraries, and of the examples, in the closed loop against `full`: README's table of planners.

    pip install 'jaxbiped[planners]'
    python -m sweeps.studies.outside_planners [--arenas 600] [--seed 0] [--out FOLDER]

Each is a file of under 60 lines in `sweeps/examples/planners`. All walk the same arenas with the same noise, paired
statistics are against `full`. `plan ms` is the mean time of one plan on one core beside the other queue's; it cannot be
told of planners that are compiled into the mission's program.
"""

import argparse
import time
from pathlib import Path

import polars as pl
from rich.console import Console
from rich.table import Table

import jaxbiped as jb
from sweeps.examples.planners.clearance import Clearance
from sweeps.examples.planners.fast_marching import fast_marching
from sweeps.examples.planners.pathfinding_astar import pathfinding_astar
from sweeps.examples.planners.rrt_connect import rrt_connect
from sweeps.examples.planners.wall_follower import WallFollower

STRATEGIES = ["full", Clearance(), pathfinding_astar, fast_marching, rrt_connect, WallFollower(), jb.StraightLine()]


def main() -> None:
    """Play the study, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--arenas", type=int, default=600)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    study = jb.Study(jb.RandomArenas(count=args.arenas), STRATEGIES, seed=args.seed)
    begun = time.perf_counter()
    results = jb.evaluate(study, out=args.out)
    seconds = time.perf_counter() - begun
    columns = "planner", "reached %", "interval", "minus full, points", "interval", "time minus full, min", "interval"
    table = Table(*columns, "fell, hit %", "plan ms", title=f"{args.arenas} arenas, seed {args.seed}")
    for name in results.strategies:
        rows = results.rows.filter(pl.col("strategy") == name)
        own = results.compare().statistics.summary(name).success
        cells = [name, f"{100 * own.estimate:.1f}", span(own, 100)]
        if name == "full":
            cells += ["", "", "", ""]
        else:
            pair = results.compare(name, "full").statistics.pair(name, "full")
            minutes = pair.time.mean
            cells += [f"{100 * pair.success.estimate:+.1f}", span(pair.success, 100)]
            cells += [f"{minutes.estimate / 60:+.2f}" if minutes.valid else "-", span(minutes, 1 / 60, 2)]
        hurt = rows["code"].is_in(["fell", "collided", "out_of_bounds"]).mean()
        spent = rows["planning_time"].sum() / rows["planning_calls"].sum() if rows["planning_time"].count() else None
        cells += [f"{100 * hurt:.1f}", "in the program" if spent is None else f"{1000 * spent:.1f}"]
        table.add_row(*cells)
    Console(width=160).print(table)
    outside = results.rows["planning_time"].sum()
    print(f"Of {seconds:.0f} s, {outside:.0f} s of planning on the host, summed over the queues that plan at once.")


def span(value, scale: float, digits: int = 1) -> str:
    """An interval."""
    if not value.valid or value.low is None:
        return "-"
    return f"[{scale * value.low:.{digits}f}, {scale * value.high:.{digits}f}]"


if __name__ == "__main__":
    main()
