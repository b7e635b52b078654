"""The report as one self-contained HTML page: no network, no script, all figures inside."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from functools import cache
from importlib import resources

import jinja2
import polars as pl

from jaxbiped.report.answer_text import MEASURES, answer, part, verdict
from jaxbiped.report.grid import Grid, to_grid, typeset
from jaxbiped.report.page_figures import Plot, attribution_sheet, plots
from jaxbiped.report.tables import (
    code_sheet,
    metric_sheet,
    metric_stratum_sheet,
    pair_sheet,
    strategy_sheets,
    stratum_sheet,
    success_sheet,
)
from jaxbiped.report.words import OPEN, number, signed
from jaxbiped.statistics import Comparison
from jaxbiped.study import Manifest

PAGE = "report.html"


@dataclass(frozen=True)
class Key:
    """One of the figures under the answer."""

    name: str
    value: str
    limits: str
    shown: bool  # whether a difference is shown


@dataclass(frozen=True)
class Section:
    """A part of the page: text, then figures, then tables."""

    title: str
    text: tuple[str, ...] = ()
    plots: tuple[Plot, ...] = ()
    grids: tuple[Grid, ...] = ()
    kind: str = ""  # "wide": figures below each other; "pairs": two side by side


@dataclass(frozen=True)
class Page:
    """Everything on the page, in order."""

    title: str
    kicker: str
    answer: tuple[str, ...]
    keys: tuple[Key, ...]
    sections: tuple[Section, ...]
    limitations: tuple[str, ...]
    commands: tuple[str, ...]
    facts: dict[str, str]
    config: str
    warnings: tuple[str, ...] = field(default=())


def render(page: Page) -> str:
    """The page as HTML; the same page gives the same text. Everything on a page is escaped, except its figures."""
    return template().render(page=page, css=resources.files("jaxbiped.report").joinpath("page.css").read_text())


@cache
def template() -> jinja2.Template:
    """`page.html` beside this file."""
    environment = jinja2.Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    return environment.from_string(resources.files("jaxbiped.report").joinpath("page.html").read_text())


def keys(comparison: Comparison) -> tuple[Key, ...]:
    """The differences of the pair that the page is about, over all arenas."""
    if comparison.question is None:
        return ()
    first, second = comparison.question
    pair = comparison.pair(first, second)
    found = []
    for measure in MEASURES:
        value, _ = part(pair, measure)
        if not value.valid:
            continue
        limits = "too few arenas, or too similar, for an interval"
        if value.low is not None:
            low, high = (typeset(signed(limit * measure.scale, measure.digits)) for limit in (value.low, value.high))
            limits = f"{low} to {high}, on {value.n:,} arenas"
        name = f"{measure.name}, {first} minus {second}"
        amount = typeset(signed(value.estimate * measure.scale, measure.digits))
        found.append(Key(name, f"{amount} {measure.unit}", limits, verdict(pair, measure) != OPEN))
    return tuple(found)


def sections(frame: pl.DataFrame, comparison: Comparison) -> tuple[Section, ...]:
    """The strategies, the pair, its strata, and how the missions ended.

    Args:
      frame: the rows that `comparison` was made from.
    """
    drawn = plots(frame, comparison)
    kinds = [kind for kind in ("family", "difficulty") if len(comparison.strata(kind)) > 1]
    found = [
        Section("Strategies", plots=tuple(drawn["strategies"]), grids=tuple(map(to_grid, strategy_sheets(comparison)))),
    ]
    if comparison.question:
        first, second = comparison.question
        pairs = [pair_sheet(comparison)]
        sheets = [stratum_sheet(comparison, first, second, kind) for kind in kinds]
        if comparison.metrics:
            pairs.append(metric_sheet(comparison, first, second))
            sheets += [metric_stratum_sheet(comparison, first, second, kind) for kind in kinds]
        grids = tuple(map(to_grid, pairs))
        found.append(Section("On the same arenas", plots=tuple(drawn["strata"] + drawn["pair"]), grids=grids))
        strata = tuple(map(to_grid, sheets))
        rates = tuple(to_grid(success_sheet(comparison, kind)) for kind in kinds)
        found.append(Section("Where it differs", grids=strata + rates))
    tables = [code_sheet(comparison)]
    if comparison.question:
        tables.append(attribution_sheet(frame, *comparison.question))
    grids = tuple(to_grid(table) for table in tables)
    return (*found, Section("How missions fail", plots=tuple(drawn["failures"]), grids=grids))


def facts(comparison: Comparison, manifest: Manifest) -> dict[str, str]:
    """Where the numbers come from."""
    versions = ", ".join(f"{name} {version}" for name, version in manifest.versions.items())
    speed = (
        f" ({manifest.rows / manifest.wall_time:.0f} missions a second)" if manifest.wall_time and manifest.rows else ""
    )
    return {
        "Seed": str(manifest.seed),
        "Config hash": manifest.config_hash,
        "Started": manifest.started,
        "Wall time": f"{number(manifest.wall_time, 1)} s{speed}; compilation {number(manifest.compile_time, 1)} s",
        "Device": manifest.device,
        "Versions": versions,
        "Bootstraps": f"{comparison.resamples} resamples, seed {comparison.seed}",
    }


@dataclass(frozen=True)
class PageNotes:
    """What the page of a comparison says besides its numbers."""

    title: str
    limitations: tuple[str, ...]
    commands: tuple[str, ...]  # that made it
    more: tuple[Section, ...] = ()  # sections between the tables and the limitations
    warnings: tuple[str, ...] = ()  # what to read first


def page_of(frame: pl.DataFrame, comparison: Comparison, manifest: Manifest, notes: PageNotes) -> Page:
    """The page of one comparison.

    Args:
      frame: the rows that the comparison was made from.
    """
    arenas = comparison.summary(comparison.strategies[0]).n
    kicker = f"jaxbiped · {arenas:,} random arenas · seed {manifest.seed} · intervals at {100 * comparison.level:g} %"
    return Page(
        title=notes.title,
        kicker=kicker,
        answer=tuple(typeset(sentence) for sentence in answer(comparison)),
        keys=keys(comparison),
        sections=(*sections(frame, comparison), *notes.more),
        limitations=notes.limitations,
        commands=notes.commands,
        facts=facts(comparison, manifest),
        config=json.dumps(manifest.config, indent=2, sort_keys=True),
        warnings=notes.warnings,
    )
