"""Rows are what they were, bit for bit; see `tests/study/golden.py`."""

import polars as pl
import pytest
from polars.testing import assert_frame_equal

from tests.study import golden


@pytest.mark.parametrize(
    "kind", [k if k in golden.QUICK else pytest.param(k, marks=pytest.mark.slow) for k in golden.KINDS]
)
def test_rows_are_as_they_were(kind):
    before, rows = pl.read_parquet(golden.FOLDER / f"{kind}.parquet"), golden.play(kind)
    if (golden.FOLDER / f"{kind}.machine").read_text().strip() == golden.machine():
        changed = [name for name in before.columns if not rows[name].equals(before[name], null_equal=True)]
        assert not changed
    assert_frame_equal(rows.select(before.columns), before, check_exact=False, rel_tol=golden.ELSEWHERE)
