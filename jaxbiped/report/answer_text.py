"""The project's question, answered in sentences that claim no more than the numbers support."""

from __future__ import annotations

from collections.abc import Sequence

from jaxbiped.report.measures import DISTANCE as DISTANCE
from jaxbiped.report.measures import MEASURES as MEASURES
from jaxbiped.report.measures import SUCCESS as SUCCESS
from jaxbiped.report.measures import TIME as TIME
from jaxbiped.report.measures import Measure as Measure
from jaxbiped.report.words import AHEAD, BEHIND, OPEN, interval, p_value, percent, signed
from jaxbiped.statistics import ALL, Comparison, Estimate, PairComparison, PairedMetric
from jaxbiped.statistics.intervals import NOTHING

ALPHA = 0.05


def part(pair: PairComparison, measure: Measure) -> tuple[Estimate, float | None]:
    """The difference of a measure with its interval, and its corrected p."""
    if measure is SUCCESS:
        return pair.success, pair.success.p_holm
    metric = paired_metric(pair, measure)
    return (metric.mean, metric.p_holm) if metric else (NOTHING, None)


def paired_metric(pair: PairComparison, measure: Measure) -> PairedMetric | None:
    """The pair's numbers for a measure other than success; None if it was not computed."""
    return pair.metrics.get(measure.name) if measure not in MEASURES else getattr(pair, measure.name)


def ranks_disagree(pair: PairComparison, measure: Measure) -> bool:
    """Whether the first is smaller on most arenas and yet greater on average, or vice versa."""
    if measure is SUCCESS:
        return False
    metric = paired_metric(pair, measure)
    return metric is not None and metric.mean.valid and (metric.improvement.estimate - 0.5) * metric.mean.estimate > 0


def verdict(pair: PairComparison, measure: Measure, alpha: float = ALPHA) -> str:
    """AHEAD or BEHIND (the first of the pair) if a difference is shown; else OPEN.

    A difference is shown if its corrected p is below `alpha`, its interval excludes zero, and, for a mean, the ranks
    point the same way, since the p-value is then that of a rank test.
    """
    difference, p = part(pair, measure)
    if p is None or p >= alpha or difference.low is None or ranks_disagree(pair, measure):
        return OPEN
    if difference.low <= 0 <= difference.high:
        return OPEN
    return AHEAD if (difference.estimate < 0) == measure.smaller_is_better else BEHIND


def answer(comparison: Comparison, alpha: float = ALPHA) -> tuple[str, ...]:
    """Sentences, most important first; empty if no pair was compared."""
    if comparison.question is None:
        return ()
    pair = comparison.question
    overall = comparison.pair(*pair)
    sentences = [headline(overall, alpha), success_sentence(comparison, overall, alpha)]
    sentences += [metric_sentence(overall, measure, alpha) for measure in (DISTANCE, TIME)]
    families = [comparison.pair(*pair, stratum) for stratum in comparison.strata("family")]
    if len(families) > 1:
        sentences += [family_sentence(families, measure, alpha) for measure in MEASURES]
    level = f"{100 * comparison.level:g} %"
    return (
        *sentences,
        f"Intervals are at {level}; p-values are corrected by Holm's method; shown means p < {alpha:g}.",
    )


def headline(pair: PairComparison, alpha: float) -> str:
    """Which measures are shown to differ over all arenas."""
    verdicts = {measure.name: verdict(pair, measure, alpha) for measure in MEASURES}
    groups = [
        (f"{pair.first} beats {pair.second} in", AHEAD),
        (f"{pair.second} beats {pair.first} in", BEHIND),
        ("no difference is shown in", OPEN),
    ]
    parts = [
        f"{words} {listed([name for name, value in verdicts.items() if value == group])}"
        for words, group in groups
        if group in verdicts.values()
    ]
    return f"Over {pair.stratum.name}, {'; '.join(parts)}."


def success_sentence(comparison: Comparison, pair: PairComparison, alpha: float) -> str:
    """How often each reached the goal."""
    rates = [comparison.summary(name, ALL).success for name in (pair.first, pair.second)]
    start = f"On {pair.success.n} arenas {pair.first} reached the goal in {percent(rates[0].estimate)} %"
    start += f" and {pair.second} in {percent(rates[1].estimate)} %"
    return f"{start}: {claim(pair, SUCCESS, alpha)}."


def metric_sentence(pair: PairComparison, measure: Measure, alpha: float) -> str:
    """Distance or time on the arenas that both solved."""
    metric: PairedMetric = getattr(pair, measure.name)
    if not metric.mean.valid:
        return f"No arena was solved by both, so {measure.name} cannot be compared."
    verb = "walked" if measure is DISTANCE else "took"
    text = f"On the {metric.n} arenas that both solved, {pair.first} {verb} {claim(pair, measure, alpha)}"
    if ranks_disagree(pair, measure) and metric.mean.estimate:
        often = 100 * metric.improvement.estimate
        text += f"; average and ranks disagree ({pair.first} has the smaller {measure.name} with probability"
        text += f" {often:.0f} %, ties counted half)"
    return f"{text}."


def claim(pair: PairComparison, measure: Measure, alpha: float) -> str:
    """A difference in words, with its interval and p."""
    difference, p = part(pair, measure)
    limits = interval(difference, measure.scale, measure.digits)
    numbers = f"{limits}, p {p_value(p)}" if limits else "too few arenas, or too similar, for an interval"
    amount = f"{abs(difference.estimate) * measure.scale:.{measure.digits}f} {measure.unit}"
    direction = measure.more if difference.estimate > 0 else measure.less
    text = f"{amount} {direction}" if difference.estimate else f"{amount} more or less"
    text = text if measure is SUCCESS else f"{text} on average"
    return f"{text} ({numbers})" + ("" if verdict(pair, measure, alpha) != OPEN else "; no difference is shown")


def family_sentence(pairs: Sequence[PairComparison], measure: Measure, alpha: float) -> str:
    """The families in which the first is ahead in a measure, behind, or neither is shown."""
    groups = {AHEAD: [], BEHIND: [], OPEN: []}
    for pair in pairs:
        difference, _ = part(pair, measure)
        group = verdict(pair, measure, alpha)
        if group == OPEN:
            groups[group].append(pair.stratum.name)
        else:
            limits = interval(difference, measure.scale, measure.digits)
            amount = signed(difference.estimate * measure.scale, measure.digits)
            groups[group].append(f"{pair.stratum.name} ({amount} {measure.unit}, {limits})")
    first, second = pairs[0].first, pairs[0].second
    parts = [
        f"{words} {listed(groups[group])}"
        for words, group in [
            (f"{first} is ahead of {second} in", AHEAD),
            ("behind in" if groups[AHEAD] else f"{first} is behind {second} in", BEHIND),
            ("no difference is shown in", OPEN),
        ]
        if groups[group]
    ]
    return f"By {measure.name}, family by family: {'; '.join(parts)}."


def listed(names: Sequence[str]) -> str:
    """a, b and c."""
    return " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else "".join(names)
