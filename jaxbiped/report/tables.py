"""Tables of a comparison, for the terminal and for markdown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich import box
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from jaxbiped.report.answer_text import ALPHA, DISTANCE, MEASURES, SUCCESS, TIME, answer, part
from jaxbiped.report.measures import Measure, metric_measures
from jaxbiped.report.words import NONE, brackets, number, p_cell, percent, signed
from jaxbiped.statistics import ALL, CODES, Comparison, Estimate, PairComparison, PairedMetric

Row = tuple[str, ...]
MEANING = {
    "spl": "success weighted by path length",
    "clearance": "the smallest distance from boxes",
    "replans": "plans after the first",
    "measuring": "the share of time spent measuring",
    "energy": "work done by the servos",
}


@dataclass(frozen=True)
class Sheet:
    """A table of text that can be shown anywhere. The first column is left-aligned, the others right-aligned."""

    title: str
    columns: Row
    groups: tuple[tuple[Row, ...], ...]  # rows, in groups separated by a line
    notes: tuple[str, ...] = ()


def to_rich(sheet: Sheet) -> Table:
    """A sheet for the terminal."""
    table = Table(
        title=sheet.title,
        title_justify="left",
        title_style="bold",
        caption="\n".join(sheet.notes) or None,
        caption_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        show_edge=False,
    )
    for index, column in enumerate(sheet.columns):
        table.add_column(column, justify="right" if index else "left", no_wrap=index == 0, overflow="fold")
    for group in sheet.groups:
        for row in group:
            table.add_row(*row)
        table.add_section()
    return table


def to_markdown(sheet: Sheet) -> str:
    """A sheet for `summary.md`, including title and notes."""
    lines = [f"### {sheet.title}", ""]
    rules = [":--"] + ["--:"] * (len(sheet.columns) - 1)
    rows = [sheet.columns, tuple(rules), *(row for group in sheet.groups for row in group)]
    for row in rows:
        cells = [f"**{row[0]}**", *row[1:]] if not any(row[1:]) else row  # a group's own heading
        lines.append("| " + " | ".join(" ".join(cell.split()) for cell in cells) + " |")
    return "\n".join([*lines, "", *(f"{note}  " for note in sheet.notes)]).rstrip() + "\n"


def comparison_table(comparison: Comparison) -> Table:
    """The pairs of a comparison over all arenas, for the terminal."""
    return to_rich(pair_sheet(comparison, detailed=1))


def terminal(comparison: Comparison) -> Group:
    """What a comparison prints, 80 columns wide: strategies, failures, pairs, the question by family, the answer."""
    sheets = [*strategy_sheets(comparison), code_sheet(comparison), pair_sheet(comparison, detailed=1)]
    if comparison.question and comparison.metrics:
        sheets.append(metric_sheet(comparison, *comparison.question))
    if comparison.question and len(comparison.strata("family")) > 1:
        sheets.append(short_stratum_sheet(comparison, *comparison.question, "family"))
    blocks: list[RenderableType] = []
    for sheet in sheets:
        if sheet.groups:
            blocks += [to_rich(sheet), ""]
    return Group(*blocks, *(Text(sentence) for sentence in answer(comparison)))


def markdown_sheets(comparison: Comparison) -> tuple[Sheet, ...]:
    """All tables of a comparison, in the order of `summary.md`."""
    sheets = [*strategy_sheets(comparison), code_sheet(comparison), pair_sheet(comparison)]
    pairs = dict.fromkeys((pair.first, pair.second) for pair in comparison.pairs)
    if comparison.metrics:
        sheets += [metric_sheet(comparison, first, second) for first, second in pairs]
    for kind in ("family", "difficulty"):
        if len(comparison.strata(kind)) > 1:
            sheets.append(success_sheet(comparison, kind))
            sheets += [stratum_sheet(comparison, first, second, kind) for first, second in pairs]
            if comparison.question and comparison.metrics:
                sheets.append(metric_stratum_sheet(comparison, *comparison.question, kind))
    return tuple(sheet for sheet in sheets if sheet.groups)


def strategy_sheets(comparison: Comparison) -> tuple[Sheet, Sheet]:
    """Each strategy alone: its success, and its reached missions."""
    return success_overall(comparison), reached_sheet(comparison)


def success_overall(comparison: Comparison) -> Sheet:
    """Success of each strategy with its interval, and how much of the missing part no plan could have reached."""
    summaries = [comparison.summary(name) for name in comparison.strategies]
    rows = []
    for item in summaries:
        cells = (item.strategy, percent(item.success.estimate), brackets(item.success, 100.0, sign=False))
        rows.append((*cells, percent(item.reachable.estimate), percent(item.success_of_reachable.estimate)))
    columns = ("strategy", "reached %", interval_head(comparison), "plan\nexists %", "reached\nof these %")
    notes = ("Wilson intervals. A plan exists: with perfect knowledge of the arena, for this strategy.",)
    return Sheet(f"Strategies on {summaries[0].n} arenas", columns, (tuple(rows),), notes)


def reached_sheet(comparison: Comparison) -> Sheet:
    """The mean distance and time of each strategy's reached missions, with their intervals."""
    rows = []
    for name in comparison.strategies:
        item = comparison.summary(name)
        cells = (name, str(item.distance.n))
        for measure in (DISTANCE, TIME):
            mean: Estimate = getattr(item, measure.name)
            cells += (number(mean.estimate * measure.scale if mean.valid else None, 1),)
            cells += (brackets(mean, measure.scale, sign=False),)
        rows.append(cells)
    head = interval_head(comparison)
    columns = ("strategy", "missions", "distance, cm", head, "time, min", head)
    notes = ("Means over a strategy's own reached missions, which differ between strategies; BCa bootstrap intervals.",)
    return Sheet("Reached missions of each strategy", columns, (tuple(rows),), notes)


def interval_head(comparison: Comparison) -> str:
    """The heading of a column of intervals."""
    return f"{100 * comparison.level:g} % interval"


def code_sheet(comparison: Comparison) -> Sheet:
    """How the missions of each strategy ended; codes that never occurred are left out."""
    summaries = [comparison.summary(name) for name in comparison.strategies]
    seen = [i for i in range(len(CODES)) if any(item.codes[i] for item in summaries)]
    rows = tuple((item.strategy, *(str(item.codes[i]) for i in seen)) for item in summaries)
    return Sheet("How missions ended", ("strategy", *(CODES[i].replace("_", " ") for i in seen)), (rows,))


def pair_sheet(comparison: Comparison, detailed: int | None = None) -> Sheet:
    """Pairs of strategies over all arenas: differences with intervals and corrected p-values.

    Args:
      detailed: how many of the pairs also get medians and probabilities; all by default.
    """
    pairs = [pair for pair in comparison.pairs if pair.stratum == ALL]
    columns = ("first - second", "arenas", "difference", interval_head(comparison), "p (Holm)")
    detailed = len(pairs) if detailed is None else detailed
    groups = tuple(tuple(pair_rows(pair, index < detailed)) for index, pair in enumerate(pairs))
    return Sheet("Pairs of strategies on the same arenas", columns, groups, PAIR_NOTES)


PAIR_NOTES = (
    "Success: Tango's score interval, McNemar's exact test. Distance and time: on arenas that both solved; BCa "
    "bootstrap intervals; Wilcoxon's signed-rank test (zeros ranked, then left out: Pratt).",
    "Differences are first minus second: with a negative distance or time, the first is shorter or faster. "
    "P(shorter), P(faster): the probability that the first is, ties counted half.",
    "p-values are corrected by Holm's method for all tests of the table.",
)


def pair_rows(pair: PairComparison, detailed: bool) -> list[Row]:
    """One pair as rows: success, then the mean of each metric; with details also its median and probability."""
    success = pair.success
    value = signed(100 * success.estimate if success.valid else None, 1)
    rows = [(f"{pair.first} - {pair.second}", "", "", "", "")]
    rows.append(("  success, points", str(success.n), value, brackets(success, 100.0), p_cell(success.p_holm)))
    for measure, better in ((DISTANCE, "  P(shorter), %"), (TIME, "  P(faster), %")):
        metric: PairedMetric = getattr(pair, measure.name)
        estimates = [(f"  {measure.name}, {measure.unit}", metric.mean, p_cell(metric.p_holm))]
        if detailed:
            estimates.append((f"  {measure.name}, median", metric.median, ""))
        for label, estimate, p in estimates:
            value = signed(estimate.estimate * measure.scale if estimate.valid else None, measure.digits)
            rows.append((label, str(metric.n), value, brackets(estimate, measure.scale, measure.digits), p))
        if detailed:
            chance = metric.improvement
            limits = brackets(chance, 100.0, 0, sign=False)
            rows.append((better, str(metric.n), percent(chance.estimate, 0), limits, f"{metric.zeros} ties"))
    return rows


def metric_sheet(comparison: Comparison, first: str, second: str) -> Sheet:
    """Metrics other than success, distance and time: their means by strategy, and a pair's differences."""
    pair, rows = comparison.pair(first, second), []
    for measure in metric_measures(comparison):
        difference, p = part(pair, measure)
        means = [comparison.summary(name).metrics[measure.name].estimate for name in (first, second)]
        own = [number(None if mean is None else mean * measure.scale, measure.digits) for mean in means]
        rows.append((measure.title, *own, str(difference.n), difference_cell(difference, measure), p_cell(p)))
    columns = ("metric", first, second, "both", "difference", "p")
    notes = (
        f"Means over a strategy's own missions that have a value, then differences where both have one, with "
        f"{100 * comparison.level:g} % intervals and p-values corrected by Holm's method for this table.",
        *explained(comparison),
    )
    return Sheet(f"Other metrics: {first} - {second}", columns, (tuple(rows),), notes)


def short_stratum_sheet(comparison: Comparison, first: str, second: str, kind: str) -> Sheet:
    """One pair in every stratum of a kind, narrow enough for a terminal: a star instead of a p-value."""
    rows = []
    for stratum in (ALL, *comparison.strata(kind)):
        pair = comparison.pair(first, second, stratum)
        cells = []
        for measure, digits in ((SUCCESS, 0), (DISTANCE, 0), (TIME, 1)):
            estimate, p = part(pair, measure)
            value = signed(estimate.estimate * measure.scale if estimate.valid else None, digits)
            limits = brackets(estimate, measure.scale, digits)
            star = "*" if p is not None and p < ALPHA else " "
            cells.append((value if limits == NONE else f"{value} {limits}") + star)
        name = stratum.name.replace(" to ", "–")  # as narrow as the name of a family
        rows.append((name, str(pair.success.n), cells[0], str(pair.time.n), *cells[1:]))
    columns = (kind, "arenas", "success, points", "both", "distance, cm", "time, min")
    notes = (f"Mean differences, first minus second, with intervals. *: p < {ALPHA:g} after Holm's correction.",)
    return Sheet(f"{first} - {second} by {kind}", columns, (tuple(rows[:1]), tuple(rows[1:])), notes)


def stratum_sheet(comparison: Comparison, first: str, second: str, kind: str) -> Sheet:
    """One pair in every stratum of a kind: a row each."""
    return measures_by_stratum(comparison, first, second, kind, MEASURES, f"{first} - {second} by {kind}")


def metric_stratum_sheet(comparison: Comparison, first: str, second: str, kind: str) -> Sheet:
    """The same for metrics other than success, distance and time."""
    title = f"Other metrics, {first} - {second} by {kind}"
    return measures_by_stratum(comparison, first, second, kind, metric_measures(comparison), title)


def measures_by_stratum(
    comparison: Comparison, first: str, second: str, kind: str, measures: Sequence[Measure], title: str
) -> Sheet:
    """Differences of measures of a pair, in every stratum of a kind."""
    rows = []
    for stratum in (ALL, *comparison.strata(kind)):
        cells = (stratum.name,)
        for measure in measures:
            estimate, p = part(comparison.pair(first, second, stratum), measure)
            cells += (str(estimate.n), difference_cell(estimate, measure), p_cell(p))
        rows.append(cells)
    columns = (kind,)
    for measure in measures:
        columns += ("arenas" if measure is SUCCESS else "both", measure.title, "p")
    what = f"{kind} tables" if measures is MEASURES else f"{kind} tables of metrics"
    notes = (f"Differences, first minus second; p-values corrected by Holm's method within {what}.",)
    return Sheet(title, columns, (tuple(rows[:1]), tuple(rows[1:])), notes)


def explained(comparison: Comparison) -> Row:
    """The meaning of the built-in metrics in a comparison."""
    said = [f"{name}: {text}" for name, text in MEANING.items() if name in comparison.metrics]
    return (f"{'; '.join(said)}.",) if said else ()


def difference_cell(estimate: Estimate, measure: Measure) -> str:
    """A difference with its interval, in the measure's unit."""
    value = signed(estimate.estimate * measure.scale if estimate.valid else None, measure.digits)
    limits = brackets(estimate, measure.scale, measure.digits)
    return value if limits == NONE else f"{value} {limits}"


def success_sheet(comparison: Comparison, kind: str) -> Sheet:
    """Success of every strategy in every stratum of a kind."""
    rows = []
    for stratum in comparison.strata(kind):
        summaries = [comparison.summary(name, stratum) for name in comparison.strategies]
        cells = [
            f"{percent(item.success.estimate)} {brackets(item.success, 100.0, 0, sign=False)}" for item in summaries
        ]
        rows.append((stratum.name, str(max(item.n for item in summaries)), *cells))
    columns = (kind, "arenas", *comparison.strategies)
    return Sheet(f"Success in % by {kind}", columns, (tuple(rows),), ("Wilson intervals.",))
