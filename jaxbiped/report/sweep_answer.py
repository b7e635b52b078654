"""The findings of a sweep in sentences: where one strategy is ahead of another, and which axes change nothing."""

from __future__ import annotations

from collections.abc import Sequence

from jaxbiped.report.answer_text import MEASURES, Measure, listed, part
from jaxbiped.report.words import NONE, brackets, signed
from jaxbiped.statistics import Estimate, PairComparison
from jaxbiped.statistics.idle_axes import IdleSpan
from jaxbiped.statistics.sweep_points import PointResult, SweepResult


def sentences(result: SweepResult, idle: Sequence[IdleSpan] = ()) -> tuple[str, ...]:
    """At how many points the first of the question's pair is ahead, and where by most; then what changes nothing."""
    said = []
    if result.question is not None:
        said = [measure_sentence(result, measure, *result.question) for measure in MEASURES]
    return (*said, *map(idle_sentence, idle))


def measure_sentence(result: SweepResult, measure: Measure, first: str, second: str) -> str:
    """For one measure: at how many points which of two strategies is ahead, and where by most."""
    found = [(point, part(point.pair, measure)[0]) for point in result.points if point.pair]
    known = [(point, value) for point, value in found if value.valid and value.low is not None]
    sign = -1 if measure.smaller_is_better else 1
    ahead = [item for item in known if min(sign * item[1].low, sign * item[1].high) > 0]
    behind = [item for item in known if max(sign * item[1].low, sign * item[1].high) < 0]
    open_, none = len(known) - len(ahead) - len(behind), len(found) - len(known)
    name = measure.name.capitalize()
    if not found:
        return f"{name}: no point has missions of both {first} and {second}."
    if not ahead and not behind:
        text = f"{name}: no difference between {first} and {second} is shown at {any_of(len(found))}."
        return f"{text} {without_interval(none)}".rstrip()
    if len(ahead) == len(found) or len(behind) == len(found):
        side = "ahead of" if ahead else "behind"
        text = f"{name}: {first} is {side} {second} at {every_one_of(len(found))}."
    else:
        sides = [f"ahead of {second} at {len(ahead)}"] if ahead else []
        sides += [f"behind {'it' if ahead else second} at {len(behind)}"] if behind else []
        text = f"{name}: {first} is {listed(sides)} of {len(found)} points."
        if open_:
            text += f" At {open_} the interval includes zero."
    return " ".join([text, *filter(None, [without_interval(none)]), most(ahead, behind, sign, measure)])


def any_of(count: int) -> str:
    """The points, in a negation."""
    return "the only point" if count == 1 else f"any of the {count} points"


def every_one_of(count: int) -> str:
    """The points, all of them."""
    return "the only point" if count == 1 else "both points" if count == 2 else f"all {count} points"


def without_interval(count: int) -> str:
    """The sentence about points whose difference has no interval."""
    return f"At {count} there is no interval: too few arenas were solved, or all are alike." if count else ""


def most(
    ahead: Sequence[tuple[PointResult, Estimate]],
    behind: Sequence[tuple[PointResult, Estimate]],
    sign: int,
    measure: Measure,
) -> str:
    """Where the first strategy is ahead by most or, if it never is, behind by most."""
    items, word = (ahead, "lead") if ahead else (behind, "deficit")
    point, _ = max(items, key=lambda item: abs(item[1].estimate))
    at = listed([f"{name} = {value:.4g}" for name, value in point.values.items()])
    return f"The greatest {word} is at {at}: {difference(point.pair, measure)} {measure.unit}."


def idle_sentence(span: IdleSpan) -> str:
    """The sentence about a range of an axis that changes nothing."""
    if span.whole:
        return f"{span.field} changes nothing: every mission is the same at all {span.values} values."
    where = f"from {span.low:.4g} to {span.high:.4g}"
    return f"{span.field} changes nothing {where}: every mission is the same at these {span.values} values."


def difference(pair: PairComparison | None, measure: Measure) -> str:
    """A paired difference with its interval."""
    if pair is None or not part(pair, measure)[0].valid:
        return NONE
    value = part(pair, measure)[0]
    text = signed(value.estimate * measure.scale, measure.digits)
    limits = brackets(value, measure.scale, measure.digits)
    return text if limits == NONE else f"{text} {limits}"
