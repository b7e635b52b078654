"""Tests of whether two strategies differ by less than a margin, over all arenas and in strata."""

from __future__ import annotations

from dataclasses import dataclass, replace

import polars as pl

from jaxbiped.errors import InputError
from jaxbiped.statistics.comparison import Stratum, paired, strata
from jaxbiped.statistics.intervals import Estimate
from jaxbiped.statistics.multiple_testing import holm
from jaxbiped.statistics.paired import equivalent_mean, equivalent_success

MEASURES = ("success", "distance", "time")


@dataclass(frozen=True)
class Equivalence:
    """Two one-sided tests for one measure in one stratum. Differences are first minus second."""

    stratum: Stratum
    measure: str  # one of MEASURES
    margin: float  # [fraction], [m] or [s]
    difference: Estimate  # interval at level 1 - 2 alpha; p_holm corrected within measure and kind of stratum
    alpha: float

    @property
    def shown(self) -> bool:
        """Whether the difference is shown to be less than the margin."""
        return self.difference.p_holm is not None and self.difference.p_holm < self.alpha


def equivalences(
    frame: pl.DataFrame, first: str, second: str, margins: dict[str, float], alpha: float = 0.05
) -> tuple[Equivalence, ...]:
    """Test each measure that has a margin, on all arenas and on each stratum.

    Args:
      frame: rows with two names in `strategy`.
      margins: measure to margin [fraction], [m] or [s]; above 0, and for success below 1.

    Raises:
      InputError: a margin that is not a positive number.
    """
    for measure, margin in margins.items():
        if measure not in MEASURES:
            raise InputError(f"must be one of {', '.join(MEASURES)}", field="margin", value=measure)
        if not 0 < margin < (1 if measure == "success" else float("inf")):
            allowed = "must be above 0 and below 1" if measure == "success" else "must be above 0"
            raise InputError(allowed, field=f"margin-{measure}", value=margin)
    found = []
    for stratum, rows in strata(frame):
        both, solved = paired(*(rows.filter(pl.col("strategy") == name) for name in (first, second)))
        for measure, margin in margins.items():
            if measure == "success":
                a, b = both["success"].to_numpy(), both["success_second"].to_numpy()
                value = equivalent_success(int((a & ~b).sum()), int((b & ~a).sum()), len(both), margin, alpha)
            else:
                differences = (solved[measure] - solved[f"{measure}_second"]).round(4).to_numpy()
                value = equivalent_mean(differences, margin, alpha)
            found.append(Equivalence(stratum, measure, margin, value, alpha))
    return corrected(found)


def corrected(found: list[Equivalence]) -> tuple[Equivalence, ...]:
    """The tests with Holm's p-values, with one correction for each measure and kind of stratum."""
    tables: dict[tuple[str, str], list[int]] = {}
    for index, item in enumerate(found):
        tables.setdefault((item.measure, item.stratum.kind), []).append(index)
    result = list(found)
    for table in tables.values():
        for index, p in zip(table, holm([found[i].difference.p for i in table]), strict=True):
            result[index] = replace(found[index], difference=replace(found[index].difference, p_holm=p))
    return tuple(result)
