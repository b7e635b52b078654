"""Tables and pictures of verified primitives."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import polars as pl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from rich.console import Group

from jaxbiped.biped.gait import PrimitiveTable
from jaxbiped.executors.motion_library import LibraryConfig
from jaxbiped.files import write_whole
from jaxbiped.report.library_file import displacement
from jaxbiped.report.style import own_style
from jaxbiped.report.tables import Sheet, to_markdown, to_rich
from jaxbiped.report.words import NONE, number, percent, signed
from jaxbiped.statistics.intervals import proportion

Tables = Mapping[str, PrimitiveTable]
FACTORS = {  # single disturbances: heading, unit, and the undisturbed value
    "friction": ("friction", 1.0, 0.8),
    "mass": ("mass", 1.0, 1.0),
    "slope": ("slope deg", math.radians(1.0), 0.0),
    "rise": ("height mm", 1e-3, 0.0),
    "edge": ("edge mm", 1e-3, 0.0),
    "yaw": ("yaw deg", math.radians(1.0), 0.0),
    "lateral": ("to the side mm", 1e-3, 0.0),
    "clearance": ("lintel mm", 1e-3, 0.37),
}


def sheets(rows: pl.DataFrame, tables: Tables) -> tuple[Sheet, ...]:
    """All tables, for the terminal and for `summary.md`."""
    return (
        success_sheet(rows, tables),
        displacement_sheet(rows, tables),
        load_sheet(rows, tables),
        covariance_sheet(rows, tables),
        limit_sheet(rows, tables),
    )


def terminal(rows: pl.DataFrame, tables: Tables) -> Group:
    """What the command prints, 80 columns wide."""
    blocks = []
    for sheet in (success_sheet(rows, tables), displacement_sheet(rows, tables), load_sheet(rows, tables)):
        blocks += [to_rich(sheet), ""]
    return Group(*blocks)


def of(rows: pl.DataFrame, name: str, chosen: str) -> pl.DataFrame:
    """The trials of one primitive on one set."""
    return rows.filter((pl.col("primitive") == name) & (pl.col("set") == chosen))


def title(name: str) -> str:
    """A primitive's display name."""
    return name.replace("_", " ")


def success_sheet(rows: pl.DataFrame, tables: Tables) -> Sheet:
    """How often each primitive succeeds, and how the other trials end."""
    lines = []
    for name, table in tables.items():
        line = [title(name), f"{table.duration:g}"]
        for chosen in ("mild", "hard"):
            trials = of(rows, name, chosen)
            share = proportion(int(trials["success"].sum()), len(trials))
            line += [percent(share.estimate, 0), f"{percent(share.low, 0)}-{percent(share.high, 0)}"]
        hard = of(rows, name, "hard")
        line += [str(int(hard[word].sum())) for word in ("fell", "slipped", "touched")]
        lines.append(tuple(line))
    count = len(of(rows, next(iter(tables)), "mild"))
    columns = ("primitive", "s", "mild %", "95 %", "hard %", "95 %", "fell", "slipped", "touched")
    notes = (f"{count} trials of each set; Wilson's intervals. The last three columns count trials of the hard set.",)
    return Sheet("Success", columns, (tuple(lines),), notes)


def displacement_sheet(rows: pl.DataFrame, tables: Tables) -> Sheet:
    """Where each primitive ends: undisturbed, and mean and standard deviation on the mild set."""
    lines = []
    for name in tables:
        nominal = of(rows, name, "nominal").row(0, named=True)
        mean, covariance = displacement(of(rows, name, "mild"))
        sd, units = np.sqrt(np.diag(covariance)), (1e3, 1e3, math.degrees(1.0))
        off = math.hypot(nominal["error_x"], nominal["error_y"])
        line = [title(name), number(1e3 * off, 2), signed(math.degrees(nominal["error_yaw"]), 2)]
        line += [f"{signed(u * m, 2)} ± {number(u * s, 2)}" for m, s, u in zip(mean, sd, units, strict=True)]
        lines.append(tuple(line))
    columns = ("primitive", "error mm", "yaw deg", "mild: ahead mm", "left mm", "yaw deg")
    return Sheet("Displacement minus the requested displacement", columns, (tuple(lines),),
                 ("Undisturbed; then mean and standard deviation on the mild set.",))  # fmt: skip


def load_sheet(rows: pl.DataFrame, tables: Tables) -> Sheet:
    """What each primitive requires: the worst values on the mild set; energy and height undisturbed."""
    lines = []
    for name in tables:
        nominal, mild = of(rows, name, "nominal").row(0, named=True), of(rows, name, "mild")
        clearance = nominal["head_clearance"]
        lines.append((
            title(name),
            number(1e3 * nominal["slip"], 1),
            number(1e3 * mild["slip"].max(), 1),
            number(1e3 * nominal["zmp_margin"], 0),
            number(1e3 * mild["zmp_margin"].min(), 0),
            number(mild["peak_torque"].max(), 2),
            number(math.degrees(mild["peak_speed"].max()), 0),
            number(nominal["energy"], 1),
            number(100 * clearance, 1) if math.isfinite(clearance) else NONE,
            number(100 * mild["sway"].max(), 1),
        ))  # fmt: skip
    columns = ("primitive", "slip mm", "mild", "ZMP mm", "mild", "Nm", "deg/s", "J", "head cm", "sway cm")
    notes = (
        "Slip and the smallest zero moment point margin, undisturbed and worst on the mild set; torque, speed and "
        "sway, worst on the mild set; energy and the head's clearance under the lintel, undisturbed.",
    )
    return Sheet("Requirements", columns, (tuple(lines),), notes)


def covariance_sheet(rows: pl.DataFrame, tables: Tables) -> Sheet:
    """Covariances on the mild set."""
    lines = []
    for name in tables:
        _, c = displacement(of(rows, name, "mild"))
        units = np.array([1e3, 1e3, math.degrees(1.0)])
        c = c * np.outer(units, units)
        lines.append((title(name), *(signed(c[i, j], 3) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))))
    columns = ("primitive", "xx mm²", "yy mm²", "tt deg²", "xy mm²", "xt mm deg", "yt mm deg")
    return Sheet("Covariance of the displacement on the mild set", columns, (tuple(lines),),
                 ("x ahead, y to the left, t the turn.",))  # fmt: skip


def limit_sheet(rows: pl.DataFrame, tables: Tables) -> Sheet:
    """How much of each disturbance alone each primitive tolerates."""
    servo = sorted({s for s in rows["set"].unique() if s.startswith("servo")})
    lines = []
    for name in tables:
        line = [title(name)]
        for factor, (_, unit, none) in FACTORS.items():
            line.append(borne(of(rows, name, factor), factor, unit, none))
        for chosen in servo:
            trials = of(rows, name, chosen)
            line.append(f"{int(trials['success'].sum())}/{len(trials)}")
        lines.append(tuple(line))
    columns = ("primitive", *(heading for heading, _, _ in FACTORS.values()), *(f"{s} deg" for s in servo))
    notes = (
        "The range in which all tried values succeeded; ≤ and ≥ where even the outermost one did.",
        "Servo: normally distributed zero offsets of all servos with this standard deviation.",
    )
    return Sheet("Tolerated range of each disturbance alone", columns, (tuple(lines),), notes)


def borne(rows: pl.DataFrame, factor: str, unit: float, none: float) -> str:
    """The range of values over which every trial succeeded, as in "-12 to 8"."""
    if rows.is_empty():
        return NONE
    values, success = rows[factor].to_numpy(), rows["success"].to_numpy()
    sides = []
    for sign in (-1, 1):
        beyond = np.flatnonzero(sign * (values - none) > 0)
        beyond = beyond[np.argsort(np.abs(values[beyond] - none))]
        good = success[beyond].cumprod().astype(bool)
        last = values[beyond][good][-1] if good.any() else none
        word = f"{last / unit:.3g}"
        sides.append(word if not (len(good) and good.all()) else f"{'≤' if sign < 0 else '≥'}{word}")
    return " to ".join(sides)


@own_style()
def save_windows(path: Path, made: LibraryConfig) -> bool:
    """Draw how steps end by distance and yaw of their edge; return whether there were any."""
    windows = {name: one.window for name, one in made.primitives.items() if one.window is not None}
    if not windows:
        return False
    figure = Figure(figsize=(4.2 * len(windows) + 0.4, 3.6), dpi=110, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    axes = figure.subplots(1, len(windows), squeeze=False)[0]
    for ax, (name, window) in zip(axes, windows.items(), strict=True):
        edge, yaw = 1e3 * np.array(window.edge), np.degrees(window.yaw)
        shown = ax.pcolormesh(yaw, edge, np.array(window.stands), cmap=ListedColormap(["#b2433f", "#dfe9dc"]),
                              vmin=0, vmax=1, shading="nearest", edgecolors="white", linewidth=0.4)  # fmt: skip
        shown.set_rasterized(True)
        ax.plot(0, 0, "+", color="#1e222a", ms=9)
        ax.set(title=title(name), xlabel="edge turned by [deg]", ylabel="edge farther away by [mm]")
    figure.suptitle("Green: ends upright on both feet. Red: falls, or stands on the edge.", fontsize=9)
    canvas.draw()
    write_whole(path, lambda file: figure.savefig(file, format="png"))
    return True


def markdown(rows: pl.DataFrame, tables: Tables, manifest: dict, windows: bool, videos: bool) -> str:
    """`summary.md`."""
    lines = ["# Motion primitives, verified in simulation", ""]
    lines += [to_markdown(sheet) for sheet in sheets(rows, tables)]
    if windows:
        lines += ["### Where the edge may be", "", "![windows](windows.png)", ""]
    if videos:
        lines += ["### Videos", "", *(f"![{title(name)}](videos/{name}.gif)" for name in tables), ""]
    tolerance = manifest["tolerance"]
    lines += [
        "### How it was made",
        "",
        f"- Command: `{manifest['command']}`",
        f"- Success: the midpoint between the feet within {1e3 * tolerance['placement']:g} mm, the yaw within "
        f"{math.degrees(tolerance['yaw']):g} degrees, both soles within {1e3 * tolerance['height']:g} mm of their "
        f"ground, the torso within {math.degrees(tolerance['upright']):g} degrees of upright, and nothing touched by "
        "head or torso.",
        "- Falls are trials that do not end upright on the ground that they should stand on; slips end upright "
        "in another place than intended.",
        *(f"- Set `{name}`: `{json.dumps(chosen)}`" for name, chosen in manifest["sets"].items()),
        f"- {len(rows)} trials, `trials.parquet`, one row each; `--executor sampled` reads `library.toml`.",
        f"- Versions: {', '.join(f'{name} {version}' for name, version in manifest['versions'].items())}",
        "",
    ]
    return "\n".join(lines)
