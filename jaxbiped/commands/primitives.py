"""`jaxbiped primitives`: generate the motion primitives and verify them in simulation, under disturbances."""

from __future__ import annotations

import dataclasses
import io
import json
import math
import time
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path

import numpy as np
import polars as pl
from rich.console import Console

from jaxbiped.biped.agreement import CROSSING, outcomes, paths
from jaxbiped.biped.config import RobotModelConfig
from jaxbiped.biped.gait import PrimitiveTable, generate
from jaxbiped.biped.optimiser import optimise
from jaxbiped.biped.primitive_catalogue import catalogue
from jaxbiped.biped.request import Request
from jaxbiped.biped.spread import SETS
from jaxbiped.biped.trial import RIMS, Disturbance, Tolerance, passes_gate
from jaxbiped.biped.verify import trials
from jaxbiped.commands.options.primitives import PrimitivesArgs
from jaxbiped.config import config_hash, load
from jaxbiped.errors import InputError
from jaxbiped.files import new_folder, refuse_existing, write_whole
from jaxbiped.motion.config import RobotConfig
from jaxbiped.report.library_file import library, library_text
from jaxbiped.report.primitives import markdown, save_windows, terminal
from jaxbiped.report.video import save_primitive
from jaxbiped.study import store
from jaxbiped.terminal import command_line

MM, DEG = 1e-3, math.radians(1.0)
LIMITS = {  # disturbances one at a time: unit, and the values tried
    "friction": (1.0, (0.1, 0.2, 0.3, 0.4, 0.6, 1.2)),
    "mass": (1.0, (0.6, 0.7, 0.8, 0.9, 1.1, 1.2, 1.3, 1.4)),
    "slope": (DEG, (-10, -7, -5, -4, -3, 3, 4, 5, 7, 10)),
    "rise": (MM, (-20, -15, -12, -10, -8, -4, 4, 8, 10, 12, 15, 20)),
    "edge": (MM, (-35, -30, -25, -20, -15, -8, 8, 15, 20, 25, 30, 35)),
    "yaw": (DEG, (-20, -16, -12, -8, -4, 4, 8, 12, 16, 20)),
    "lateral": (MM, (-60, -40, -20, 20, 40, 60)),
    "clearance": (MM, (335, 340, 345, 350, 360)),
}
OF_EDGES, OF_GATES = ("rise", "edge", "yaw"), ("yaw", "lateral", "clearance")
SERVO = (0.5, 1.0, 2.0)  # [deg] standard deviations of servo offsets
RIM_EDGE = np.arange(0.0, 0.0901, 0.0025)  # [m] distance from the start
APART, HARD_CASES = 1e-3, 64  # [m] largest difference of backends; trials whose outcomes must be the same
DIFFERENT = 1  # exit status
WINDOW_EDGE, WINDOW_YAW = np.linspace(-0.035, 0.035, 15), np.linspace(-20, 20, 11)  # [m], [deg]


def main(args: PrimitivesArgs) -> int:
    """Run the command.

    Returns:
      Exit status 0; with `against`, 1 if the backends disagree.

    Raises:
      InputError: a robot that cannot play a primitive (which joint or leg, and when), a missing device, a
        folder that exists or cannot be written.
    """
    out = args.out or Path("results") / "primitives"
    if not args.against:
        refuse_existing(out)
    robot = load(RobotModelConfig, args.robot) if args.robot else RobotModelConfig()
    asked = {name: request for name, request in catalogue(args.pace, args.bump).items() if name in args.only}
    refuse_what_cannot_be(asked, robot, args)
    make = partial(optimise, goal=args.optimise) if args.optimise else generate
    tables = {name: make(request, robot) for name, request in asked.items()}
    console, start = Console(), time.perf_counter()
    if args.against:
        return agree(tables, robot, args, console)
    frames = []
    for name, table in tables.items():
        begin = time.perf_counter()
        frames.append(verify(name, table, robot, args))
        spent = time.perf_counter() - begin
        simulated = frames[-1]["simulated"].sum()
        console.print(
            f"{name}: {len(frames[-1])} trials, {simulated:.0f} s simulated in {spent:.0f} s", highlight=False
        )
    rows = pl.concat(frames)
    command = command_line()
    with new_folder(out) as folder:
        manifest = {
            "command": command,
            "config": args.model_dump(mode="json", exclude={"out"}),
            "robot": robot.model_dump(mode="json"),
            "config_hash": config_hash(args.model_copy(update={"out": None})),
            "sets": {name: chosen.model_dump() for name, chosen in SETS.items()},
            "tolerance": Tolerance().model_dump(),
            "versions": store.versions(),
            "wall_time": time.perf_counter() - start,
        }
        buffer = io.BytesIO()
        rows.write_parquet(buffer)
        write(folder / "trials.parquet", buffer.getvalue())
        write(folder / "manifest.json", (json.dumps(manifest, indent=2) + "\n").encode())
        made = library(rows, tables, robot, args.pace, args.seed, command)
        write(folder / "library.toml", library_text(made).encode())
        pictures = save_windows(folder / "windows.png", made)
        if args.videos:
            (folder / "videos").mkdir()
            for name, table in tables.items():
                save_primitive(folder / "videos" / f"{name}.gif", name, table, robot)
        write(folder / "summary.md", markdown(rows, tables, manifest, pictures, args.videos).encode())
    console.print(terminal(rows, tables))
    console.print(f"{len(rows)} trials in {time.perf_counter() - start:.0f} s; written {out}", highlight=False)
    return 0


def refuse_what_cannot_be(asked: Mapping[str, Request], robot: RobotModelConfig, args: PrimitivesArgs) -> None:
    """Raise `InputError` about a bump or a gate that the robot cannot pass."""
    highest = RobotConfig().step
    if any(request.rise for request in asked.values()) and args.bump > highest:
        raise InputError(f"must be at most the robot's step height, {highest:g} m", field="--bump", value=args.bump)
    low = robot.head_squatting
    if any(passes_gate(request) for request in asked.values()) and args.gate <= low:
        raise InputError(f"must be above the squatting robot's head, {low:g} m", field="--gate", value=args.gate)


def agree(tables: Mapping[str, PrimitiveTable], robot: RobotModelConfig, args: PrimitivesArgs, console: Console) -> int:
    """Print how much another backend differs from `native`, and return the exit status."""
    good = True
    for name, table in tables.items():
        furthest, when = paths(table, robot, args.against, device=args.device).worst
        good = good and furthest <= APART
        console.print(
            f"{name}, {table.duration:g} s: at most {1e3 * furthest:.2f} mm apart, at {when:.1f} s", highlight=False
        )
    if "step_up" in tables:
        disturbances = CROSSING.draws(HARD_CASES, args.seed)
        native, other = outcomes(tables["step_up"], robot, disturbances, args.against, device=args.device)
        same = int((native == other).sum())
        good = good and same == HARD_CASES
        console.print(
            f"{HARD_CASES} hard steps up: {native.sum()} succeed in native and {other.sum()} in {args.against}, "
            f"the same in {same}", highlight=False,
        )  # fmt: skip
    return 0 if good else DIFFERENT


def write(path: Path, data: bytes) -> None:
    """Write a file, whole or not at all."""
    write_whole(path, lambda file: file.write(data))


def verify(name: str, table: PrimitiveTable, robot: RobotModelConfig, args: PrimitivesArgs) -> pl.DataFrame:
    """All trials of one primitive, one row each."""
    options = {} if args.backend == "native" else {"device": args.device}
    parts = []
    for record, sets in ((True, recorded(args)), (False, probes(name, table, args))):
        names, disturbances = zip(*sets, strict=True)
        lower = args.gate - Disturbance().clearance
        disturbances = [dataclasses.replace(d, clearance=d.clearance + lower) for d in disturbances]
        result = trials(table, robot, disturbances, args.backend, record=record, **options)
        parts.append(rows_of(name, names, disturbances, result))
    return pl.concat(parts).with_columns(simulated=pl.lit(table.duration))


def recorded(args: PrimitivesArgs) -> Iterator[tuple[str, Disturbance]]:
    """The sets of trials that are measured in full: undisturbed, and the sets of disturbances."""
    yield "nominal", Disturbance()
    for name, chosen in SETS.items():
        yield from ((name, disturbance) for disturbance in chosen.draws(args.draws, args.seed))


def probes(name: str, table: PrimitiveTable, args: PrimitivesArgs) -> Iterator[tuple[str, Disturbance]]:
    """Disturbances one at a time: edges of a step at all distances and yaws, and unexpected edges."""
    request = table.request
    for factor, (unit, values) in LIMITS.items():
        applies = request.rise if factor in OF_EDGES and factor not in OF_GATES else True
        if factor in OF_GATES:
            applies = passes_gate(request) or (factor in OF_EDGES and request.rise)
        if applies:
            yield from ((factor, dataclasses.replace(Disturbance(), **{factor: value * unit})) for value in values)
    rng = np.random.default_rng(args.seed)
    for degrees in SERVO:
        for _ in range(max(1, args.draws // 4)):
            yield f"servo {degrees:g}", Disturbance(servo=tuple(rng.normal(0.0, degrees * DEG, 12).tolist()))
    if name == "straight":
        yield from ((f"rim {rim}", Disturbance(rim=rim, edge=float(edge))) for rim in RIMS for edge in RIM_EDGE)
    if request.rise:
        for edge in WINDOW_EDGE:
            yield from (("window", Disturbance(edge=float(edge), yaw=float(yaw) * DEG)) for yaw in WINDOW_YAW)


def rows_of(name: str, sets, disturbances, result) -> pl.DataFrame:
    """Trials as a table: the disturbance and the outcome of each."""
    tolerance = Tolerance()
    columns = {"primitive": [name] * len(sets), "set": list(sets)}
    columns |= {
        f.name: [getattr(d, f.name) for d in disturbances] for f in dataclasses.fields(Disturbance) if f.name != "servo"
    }
    columns["servo"] = [list(d.servo) for d in disturbances]
    columns |= {f"error_{axis}": result.error[:, k] for k, axis in enumerate(("x", "y", "yaw"))}
    columns |= {f.name: getattr(result, f.name) for f in dataclasses.fields(result) if f.name != "error"}
    columns |= {word: getattr(result, word)(tolerance) for word in ("fell", "slipped", "success")}
    return pl.DataFrame(columns)
