"""The report on two stored sides: their tables, whether they are equivalent, and how many more arenas to take."""

from __future__ import annotations

from collections.abc import Sequence

from jaxbiped.report.answer_text import MEASURES, Measure
from jaxbiped.report.tables import (
    Sheet,
    code_sheet,
    metric_sheet,
    metric_stratum_sheet,
    pair_sheet,
    short_stratum_sheet,
    strategy_sheets,
    stratum_sheet,
    success_sheet,
)
from jaxbiped.report.words import NONE, brackets, p_cell, percent, signed
from jaxbiped.statistics.comparison import Comparison
from jaxbiped.statistics.equivalence import Equivalence
from jaxbiped.statistics.sample_size_plan import Plan

BY_NAME = {measure.name: measure for measure in MEASURES}


def terminal_sheets(comparison: Comparison) -> tuple[Sheet, ...]:
    """Tables for a terminal: both sides, how their missions ended, their difference, and its strata."""
    first, second = comparison.question
    kinds = [kind for kind in ("family", "difficulty") if len(comparison.strata(kind)) > 1]
    strata = [short_stratum_sheet(comparison, first, second, kind) for kind in kinds]
    return (*strategy_sheets(comparison), code_sheet(comparison), pair_sheet(comparison), *others(comparison), *strata)


def written_sheets(comparison: Comparison) -> tuple[Sheet, ...]:
    """The same tables with every p-value, for a file."""
    first, second = comparison.question
    kinds = [kind for kind in ("family", "difficulty") if len(comparison.strata(kind)) > 1]
    rates = [success_sheet(comparison, kind) for kind in kinds]
    strata = [stratum_sheet(comparison, first, second, kind) for kind in kinds]
    metrics = [metric_stratum_sheet(comparison, first, second, kind) for kind in kinds if comparison.metrics]
    own = (*strategy_sheets(comparison), code_sheet(comparison), pair_sheet(comparison), *others(comparison))
    return (*own, *rates, *strata, *metrics)


def others(comparison: Comparison) -> tuple[Sheet, ...]:
    """The table of metrics other than success, distance and time, if there are any."""
    return (metric_sheet(comparison, *comparison.question),) if comparison.metrics else ()


def equivalence_sheets(found: Sequence[Equivalence]) -> tuple[Sheet, ...]:
    """A table for each measure that was tested, with a row for each stratum."""
    measures = dict.fromkeys(item.measure for item in found)
    return tuple(
        equivalence_sheet([item for item in found if item.measure == name], BY_NAME[name]) for name in measures
    )


def equivalence_sheet(found: Sequence[Equivalence], measure: Measure) -> Sheet:
    """The equivalence table of one measure."""
    groups: dict[str, list[tuple[str, ...]]] = {}
    for item in found:
        value = item.difference
        amount = signed(value.estimate * measure.scale if value.valid else None, measure.digits)
        limits = brackets(value, measure.scale, measure.digits)
        shown = NONE if value.p is None else "yes" if item.shown else "no"
        name = f"difficulty {item.stratum.name}" if item.stratum.kind == "difficulty" else item.stratum.name
        row = (name, str(value.n), amount, limits, p_cell(value.p_holm), shown)
        groups.setdefault(item.stratum.kind, []).append(row)
    margin, alpha = found[0].margin * measure.scale, found[0].alpha
    columns = ("stratum", "arenas", "difference", f"{100 * (1 - 2 * alpha):g} % interval", "p (Holm)", "within")
    test = "score tests (Tango)" if measure.name == "success" else "t tests (Schuirmann), on arenas that both solved"
    notes = (
        f"Two one-sided {test}: within, if the difference is shown to be less than the margin (p < {alpha:g}).",
        "No test on fewer than two arenas, or if all arenas give the same difference.",
    )
    title = f"Equivalence in {measure.name}, margin {margin:g} {measure.unit}"
    return Sheet(title, columns, tuple(tuple(rows) for rows in groups.values()), notes)


def plan_sentences(plan: Plan, first: str, second: str) -> tuple[str, ...]:
    """How many arenas, the basis of that number, and its uncertainty."""
    measure = BY_NAME[plan.measure]
    wanted = f"{plan.wanted * measure.scale:g} {measure.unit}"
    start = f"{plan.arenas:,} arenas would show a difference of {wanted} in {measure.name} between {first} and {second}"
    start += f" with a power of {100 * plan.power:g} %, at {100 * (1 - plan.alpha):g} %."
    if measure.name == "success":
        basis = (
            f"In the pilot of {plan.pilot:,} arenas {percent(plan.spread)} % were solved by one side only (McNemar)."
        )
        high = f"If it were {percent(plan.spread_high)} %, the upper end of the 95 % interval"
    else:
        spread, upper = (f"{value * measure.scale:.{measure.digits}f}" for value in (plan.spread, plan.spread_high))
        basis = f"In the pilot both solved {plan.solved:,} of {plan.pilot:,} arenas; their differences have a standard"
        basis += f" deviation of {spread} {measure.unit} (paired t test)."
        high = f"If it were {upper} {measure.unit}, the upper end of the 95 % interval"
    return start, basis, f"{high}, {plan.arenas_high:,} would."
