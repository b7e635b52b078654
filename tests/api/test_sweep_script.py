"""The whole of a sweep script, as it is promised: an own planner, a sweep, rows, paired statistics and a figure."""

import runpy

import matplotlib as mpl
import polars as pl
import pytest

SCRIPT = """
from dataclasses import dataclass

import jax

import jaxbiped as jb
from sweeps.examples.planners.clearance import Clearance


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class MyPlanner(Clearance):
    pass


arenas = jb.RandomArenas(families=["bump"], count=200)
study = jb.Study(arenas=arenas, strategies=["full", "floor_only", MyPlanner(clearance=0.1)])
result = jb.sweep(study, {"costs.c3": [2, 5, 10, 20, 40]})      # or jb.evaluate(study)
rows = result.rows                                              # a polars DataFrame
said = result.compare("MyPlanner", "full")                      # paired statistics; prints as a table
print(said)
figure = result.plot("time")                                    # a matplotlib figure
"""


@pytest.mark.slow
def test_a_sweep_script_runs_as_it_is_written(tmp_path, capsys):
    (tmp_path / "script.py").write_text(SCRIPT)
    found = runpy.run_path(str(tmp_path / "script.py"))
    rows = found["rows"]
    assert isinstance(rows, pl.DataFrame) and len(rows) == 5 * 3 * 200
    assert set(rows["strategy"]) == {"full", "floor_only", "MyPlanner"} and set(rows["family"]) == {"bump"}
    assert rows.group_by("point", "strategy").agg(pl.col("success").mean())["success"].min() > 0.5
    printed = capsys.readouterr().out
    assert "MyPlanner" in printed and "full" in printed and "95 %" in printed
    assert isinstance(found["figure"], mpl.figure.Figure)
