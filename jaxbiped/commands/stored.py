"""`jaxbiped compare FOLDER`: any two strategies or sweep points of stored results, without running again."""

from __future__ import annotations

from pathlib import Path

import polars as pl
from rich.console import Console

from jaxbiped.commands.options.stored import StoredArgs
from jaxbiped.errors import InputError
from jaxbiped.files import new_folder, refuse_existing, write_whole
from jaxbiped.report.answer_text import answer
from jaxbiped.report.comparison_report import LIMITATIONS, question
from jaxbiped.report.grid import to_grid
from jaxbiped.report.page import PAGE, PageNotes, Section, page_of, render
from jaxbiped.report.stored import equivalence_sheets, plan_sentences, terminal_sheets, written_sheets
from jaxbiped.report.tables import Sheet, to_markdown, to_rich
from jaxbiped.statistics import Comparison
from jaxbiped.statistics.equivalence import equivalences
from jaxbiped.statistics.sample_size_plan import plan
from jaxbiped.study.stored_series import Side, choose, compare_sides, open_stored
from jaxbiped.terminal import command_line


def main(args: StoredArgs) -> int:
    """Run the command.

    Returns:
      Exit status 0.

    Raises:
      InputError: folders with no results, with damaged ones, or with different arenas; a strategy or point
        that does not exist; `out` exists or cannot be written.
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
    """Tables of the requested equivalence tests."""
    margins = {name: getattr(args, f"margin_{name}") for name in ("success", "distance", "time")}
    margins = {name: margin for name, margin in margins.items() if margin is not None}
    return equivalence_sheets(equivalences(frame, *comparison.question, margins, 1 - args.level)) if margins else ()


def foreseen(args: StoredArgs, frame: pl.DataFrame, comparison: Comparison) -> tuple[str, ...]:
    """How many arenas the wanted difference takes, if requested."""
    if args.wanted_difference is None:
        return ()
    first, second = comparison.question
    made = plan(frame, first, second, args.measure, args.wanted_difference, args.power, 1 - args.level)
    return plan_sentences(made, first, second)


def left_out(sides: tuple[Side, Side], frame: pl.DataFrame) -> tuple[str, ...]:
    """What is not compared, and which of the studies is unfinished."""
    sentences = []
    for folder in dict.fromkeys(side.stored.folder for side in sides):
        manifest = next(side.stored.manifest for side in sides if side.stored.folder == folder)
        if manifest.state != "finished":
            sentences.append(f"{folder} is not finished: it has {manifest.arenas:,} arenas in total.")
    most = max(len(side.rows) for side in sides)
    shared = frame["arena"].n_unique()
    if shared < most:
        sentences.append(f"{most - shared:,} arenas that only one side has are left out.")
    return tuple(sentences)


def write(
    out: Path,
    sides: tuple[Side, Side],
    comparison: Comparison,
    frame: pl.DataFrame,
    tests: tuple[Sheet, ...],
    sentences: tuple[tuple[str, ...], tuple[str, ...]],
) -> None:
    """Write a folder with `comparison.md` and a page."""
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
        PageNotes(
            title=title,
            limitations=LIMITATIONS,
            commands=commands,
            more=tuple(more),
            warnings=left_out(sides, frame),
        ),
    )
    texts = {"comparison.md": "\n".join(lines), PAGE: render(page)}
    with new_folder(out) as folder:
        for name, text in texts.items():
            write_whole(folder / name, lambda file, text=text: file.write(text.encode()))
