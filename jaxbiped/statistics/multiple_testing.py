"""Correction of p-values where several hypotheses are tested."""

from __future__ import annotations

from collections.abc import Sequence

from statsmodels.stats.multitest import multipletests


def holm(p_values: Sequence[float | None]) -> list[float | None]:
    """Holm's correction (1979) of all p-values of one table; None stays None and is not counted."""
    there = [p for p in p_values if p is not None]
    corrected = iter(multipletests(there, method="holm")[1].tolist() if there else [])
    return [None if p is None else next(corrected) for p in p_values]
