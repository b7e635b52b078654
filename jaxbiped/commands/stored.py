"""`jaxbiped compare FOLDER`: any two strategies or sweep points of stored results, without running again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import polars as pl
import pydantic
import tyro
from rich.console import Console

from jaxbiped.config import Model
from jaxbiped.errors import InputError
from jaxbiped.files import new_folder, refuse_existing, write_whole
from jaxbiped.report.answer import answer
from jaxbiped.report.grid import to_grid
from jaxbiped.report.page import PAGE, Section, page_of, render
from jaxbiped.report.stored import equivalence_sheets, plan_sentences, terminal_sheets, written_sheets
from jaxbiped.report.summary import LIMITATIONS, question
from jaxbiped.report.tables import Sheet, to_markdown, to_rich
from jaxbiped.study import Comparison
from jaxbiped.study.equivalence import equivalences
from jaxbiped.study.pilot import plan
from jaxbiped.study.sides import Side, choose, compare_sides, open_stored
from jaxbiped.terminal import command_line

Share = Annotated[float, pydantic.Field(gt=0.0, lt=1.0)]
Amount = Annotated[float, pydantic.Field(gt=0.0)]


class StoredArgs(Model):
    """Compare two strategies or sweep points of stored results, on the same arenas, without running again."""

    folders: tyro.conf.Positional[Annotated[tuple[Path, ...], pydantic.Field(min_length=1, max_length=2)]]
    """One results folder, or two on the same arenas: the first side is then of the first."""
    first: str | None = None
    """Strategy of the first side. Differences are first minus second."""
    second: str | None = None
    first_point: Annotated[int, pydantic.Field(ge=0)] | None = None
    """Sweep point of the first side; default 0."""
    second_point: Annotated[int, pydantic.Field(ge=0)] | None = None
    """Default: that of the first side."""
    level: Share = 0.95
    """Of the intervals."""
    resamples: Annotated[int, pydantic.Field(ge=10, le=1_000_000)] = 4999
    """Of the bootstraps."""
    margin_success: Share | None = None
    """Test whether success differs by less than this fraction."""
    margin_distance: Amount | None = None
    """[m] The same for distance."""
    margin_time: Amount | None = None
    """[s] The same for time."""
    plan_power: bool = False
    """Say how many arenas would show `--wanted-difference`, taking these results for a pilot."""
    wanted_difference: Amount | None = None
    """[fraction, m or s] In `--measure`."""
    measure: Literal["success", "distance", "time"] = "success"
    power: Share = 0.8
    out: Path | None = None
    """Folder to write the tables and a page into, which must not exist; by default nothing is written."""


def main(args: StoredArgs) -> int:
    """Run the command.

    Returns:
      Exit status 0.

    Raises:
      InputError: folders that hold no results, or damaged ones, or other arenas than each other; a strategy or point
        that is not there; `out` exists or cannot be written.
    """
    if args.plan_power != (args.wanted_difference is not None):
        missing = "wanted-difference" if args.plan_power else "plan-power"
        raise InputError("--plan-power and --wanted-difference go together", field=missing)
    if args.out:
        refuse_existing(args.out)
    stored = [open_stored(folder) for folder in args.folders]
    sides = choose(stored, (args.first, args.second), (args.first_point, args.second_point))
    comparison, frame = compare_sides(*sides, resamples=args.resamples, level=args.level)
    tests, planned = tested(args, frame, comparison), foreseen(args, frame, comparison)
    sentences = (*left_out(sides, frame), *answer(comparison))
    if args.out:
        write(args.out, sides, comparison, frame, tests, (sentences, planned))
    console = Console()
    for sheet in (*terminal_sheets(comparison), *tests):
        if sheet.groups:
            console.print(to_rich(sheet), "")
    for sentence in (*sentences, *planned):
        console.print(sentence, highlight=False)
    if args.out:
        console.print(f"written {args.out}: comparison.md, {PAGE}", highlight=False)
    return 0


def tested(args: StoredArgs, frame: pl.DataFrame, comparison: Comparison) -> tuple[Sheet, ...]:
    """Tables of the equivalence tests that were asked for."""
    margins = {name: getattr(args, f"margin_{name}") for name in ("success", "distance", "time")}
    margins = {name: margin for name, margin in margins.items() if margin is not None}
    return equivalence_sheets(equivalences(frame, *comparison.question, margins, 1 - args.level)) if margins else ()


def foreseen(args: StoredArgs, frame: pl.DataFrame, comparison: Comparison) -> tuple[str, ...]:
    """How many arenas the wanted difference takes, where that was asked for."""
    if args.wanted_difference is None:
        return ()
    first, second = comparison.question
    made = plan(frame, first, second, args.measure, args.wanted_difference, args.power, 1 - args.level)
    return plan_sentences(made, first, second)


def left_out(sides: tuple[Side, Side], frame: pl.DataFrame) -> tuple[str, ...]:
    """What is not compared, and which of the studies has not ended."""
    sentences = []
    for folder in dict.fromkeys(side.stored.folder for side in sides):
        manifest = next(side.stored.manifest for side in sides if side.stored.folder == folder)
        if manifest.state != "finished":
            sentences.append(f"{folder} is not finished: it is to have {manifest.arenas:,} arenas.")
    most = max(len(side.rows) for side in sides)
    shared = frame["arena"].n_unique()
    if shared < most:
        sentences.append(f"{most - shared:,} arenas that one side has and the other has not are left out.")
    return tuple(sentences)


def write(
    out: Path,
    sides: tuple[Side, Side],
    comparison: Comparison,
    frame: pl.DataFrame,
    tests: tuple[Sheet, ...],
    sentences: tuple[tuple[str, ...], tuple[str, ...]],
) -> None:
    """A folder with `comparison.md` and a page."""
    title, (said, planned) = question(comparison), sentences
    manifests = {side.stored.folder: side.stored.manifest for side in sides}
    commands = (*(manifest.command for manifest in manifests.values()), command_line())
    lines = [f"# {title}", "", *(f"- {sentence}" for sentence in (*said, *planned)), ""]
    lines += [to_markdown(sheet) for sheet in (*written_sheets(comparison), *tests)]
    lines += ["## How it was made", "", *(f"    {command}" for command in commands), ""]
    more = []
    if tests:
        more.append(Section("Are they equivalent?", grids=tuple(to_grid(sheet) for sheet in tests)))
    if planned:
        more.append(Section("How many arenas next", text=planned))
    page = page_of(
        frame,
        comparison,
        sides[0].stored.manifest,
        title=title,
        limitations=LIMITATIONS,
        commands=commands,
        more=tuple(more),
        warnings=left_out(sides, frame),
    )
    texts = {"comparison.md": "\n".join(lines), PAGE: render(page)}
    with new_folder(out) as folder:
        for name, text in texts.items():
            write_whole(folder / name, lambda file, text=text: file.write(text.encode()))
