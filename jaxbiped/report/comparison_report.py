"""`summary.md`: the question, its answer, tables and figures of a results folder, rewritten from its rows."""

from __future__ import annotations

import json
import shlex
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from jaxbiped.errors import InputError
from jaxbiped.files import write_whole
from jaxbiped.report.answer_text import answer
from jaxbiped.report.examples import example_section
from jaxbiped.report.figures import write_figures
from jaxbiped.report.page import PAGE, PageNotes, Section, page_of, render
from jaxbiped.report.stopping import stopping_sentences
from jaxbiped.report.tables import markdown_sheets, to_markdown
from jaxbiped.report.words import number
from jaxbiped.statistics import QUESTION, Comparison, compare, sample_size
from jaxbiped.study import Manifest, read, read_points
from jaxbiped.study.replay import Origin

SUMMARY = "summary.md"
QUESTION_TEXT = "When, and by how much, does bump-aware planning beat floor-only planning?"

LIMITATIONS = (
    "Distance and time are compared on arenas that both strategies solved. These are not a random sample of the "
    "arenas: an arena is left out if either of the two fails, so the differences hold for solved arenas only.",
    "The arenas come from the families of this program; a rate over all families depends on their mix.",
    "McNemar's test is exact and the interval of the difference is asymptotic, so an interval can just exclude "
    "zero where the corrected p-value is above 0.05. A difference is called shown only if both agree.",
    "Wilcoxon's test is about ranks, the interval about a mean. Where they disagree, nothing is claimed.",
    "Strata of each kind (families, thirds of difficulty) are corrected separately from the overall table.",
    "If no difference is shown, there may still be one: see the intervals.",
)


@dataclass(frozen=True)
class Report:
    """The parts of a report."""

    folder: Path
    comparison: Comparison
    manifest: Manifest
    answer: tuple[str, ...]  # sentences, most important first
    files: tuple[Path, ...]  # written: page, summary and figures
    remarks: tuple[str, ...] = ()  # what to read first


def write_comparison_report(folder: str | Path, *, point: int = 0, resamples: int = 4999, examples: int = 0) -> Report:
    """Compare the strategies of a results folder at one point, and write `report.html`, `summary.md` and figures.

    `folder_report.write_report` handles sweeps, too.

    May be called again at any time: the same rows give the same report. The bootstraps use the study's seed.

    Args:
      point: the sweep point to report on.
      resamples: resamples of the bootstraps.
      examples: number of arenas where the two strategies of the question differ most, to be replayed and drawn; this
        compiles a mission.

    Raises:
      InputError: no results, damaged results, no rows, or files that cannot be written.
    """
    folder = Path(folder)
    frame, manifest = read(folder)
    if frame.is_empty():
        raise InputError("has no rows to report on yet", file=folder)
    comparison = compare(frame, point=point, seed=manifest.seed, resamples=resamples, shown=manifest.metrics)
    figures = write_figures(folder, frame, comparison)
    frame = frame.filter(pl.col("point") == point)
    remarks = () if manifest.state == "finished" else (unfinished(comparison, manifest),)
    remarks += stopping_sentences(folder)
    more = looked_at(folder, frame, comparison, manifest, examples)
    page = page_of(
        frame,
        comparison,
        manifest,
        PageNotes(
            title=question(comparison) if comparison.question else "One strategy on random arenas",
            limitations=LIMITATIONS,
            commands=(manifest.command, shlex.join(["jaxbiped", "report", str(folder)])),
            more=more,
            warnings=remarks,
        ),
    )
    texts = {PAGE: render(page), SUMMARY: summary(comparison, manifest, figures, remarks)}
    for name, text in texts.items():
        write_whole(folder / name, lambda file, text=text: file.write(text.encode()))
    files = tuple(folder / name for name in (*texts, *figures))
    return Report(folder, comparison, manifest, answer(comparison), files, remarks)


def looked_at(
    folder: Path, frame: pl.DataFrame, comparison: Comparison, manifest: Manifest, count: int
) -> tuple[Section, ...]:
    """A section with missions of the `count` arenas where the strategies of the question differ most, if any."""
    if count == 0 or comparison.question is None:
        return ()
    values = read_points(folder).filter(pl.col("point") == comparison.point).row(0, named=True)
    point = values.pop("point")
    origins = tuple(Origin(manifest, point, values, name) for name in comparison.question)
    section = example_section(frame, comparison.question, origins, count)
    return (section,) if section else ()


def summary(comparison: Comparison, manifest: Manifest, figures: dict[str, str], remarks: tuple[str, ...] = ()) -> str:
    """The text of `summary.md`.

    Args:
      figures: file names beside the summary, with captions.
      remarks: what to read first.
    """
    lines = ["# Strategies compared", ""]
    for remark in remarks:
        lines += [f"**{remark}**", ""]
    sentences = answer(comparison)
    if sentences:
        lines += [
            f"**{question(comparison)}**",
            "",
            f"**{sentences[0]}**",
            "",
            *(f"- {text}" for text in sentences[1:]),
            "",
        ]
        lines += [pilot(comparison), ""]
    for name, caption in figures.items():
        lines += [f"![{caption}]({name})", "", f"*{caption}*", ""]
    lines += ["## Tables", ""]
    for sheet in markdown_sheets(comparison):
        lines += [to_markdown(sheet)]
    lines += ["## Limitations", "", *(f"- {text}" for text in LIMITATIONS), ""]
    return "\n".join(lines + provenance(comparison, manifest))


def unfinished(comparison: Comparison, manifest: Manifest) -> str:
    """How far an unfinished study is."""
    done = comparison.summary(comparison.strategies[0]).n
    return f"This study is not finished: it has {done} of {manifest.arenas} arenas."


def question(comparison: Comparison) -> str:
    """The question that the report answers."""
    if comparison.question == QUESTION:
        return QUESTION_TEXT
    first, second = comparison.question
    return f"How does {first} compare with {second}?"


def pilot(comparison: Comparison) -> str:
    """How many arenas would show the observed difference in success, for planning the next study."""
    pair = comparison.pair(*comparison.question)
    first, second = pair.first_only / pair.success.n, pair.second_only / pair.success.n
    text = f"Only {pair.first} reached the goal on {pair.first_only} arenas, only {pair.second} on {pair.second_only}."
    if first == second:
        return text
    n = sample_size(first, second, power=0.8)
    return f"{text} If these were the true shares, {n} arenas would show the difference with a power of 80 % (McNemar)."


def provenance(comparison: Comparison, manifest: Manifest) -> list[str]:
    """Where the numbers come from, so that anyone can reproduce them."""
    versions = ", ".join(f"{name} {version}" for name, version in manifest.versions.items())
    speed = ""
    if manifest.wall_time and manifest.rows:
        speed = f" ({manifest.rows / manifest.wall_time:.0f} missions a second, compilation included)"
    config = json.dumps(manifest.config, indent=2, sort_keys=True)
    return [
        "## How it was made",
        "",
        f"- Command: `{manifest.command}`",
        f"- Config hash: `{manifest.config_hash}`; seed {manifest.seed}; started {manifest.started}",
        f"- Wall time: {number(manifest.wall_time, 1)} s{speed}; compilation: {number(manifest.compile_time, 1)} s",
        f"- Device: {manifest.device}",
        f"- Versions: {versions}",
        f"- Sweep point {comparison.point}; bootstraps of {comparison.resamples} resamples, seed {comparison.seed}",
        "- Rows: `rows/*.parquet`, one for each arena and strategy; the manifest beside them: `manifest.json`",
        "",
        "<details><summary>Resolved configuration</summary>",
        "",
        "```json",
        config,
        "```",
        "",
        "</details>",
        "",
    ]
