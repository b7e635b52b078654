"""`jaxbiped tune` from the command line: small real missions, costs from durations, and wrong input."""

import errno
import json
import tomllib
from dataclasses import replace

import jax
import numpy as np
import polars as pl
import pytest

from jaxbiped import cli, files
from jaxbiped.config import load
from jaxbiped.mission.params import MissionConfig
from jaxbiped.statistics.schema import FAMILIES
from jaxbiped.study import trials
from jaxbiped.study.config import StudyConfig
from jaxbiped.study.evaluation import evaluate
from jaxbiped.study.trials import Trials

PAPER = np.array([1.0, 1.0, 5.0, 10.0, 100.0])
TINY = ["--arenas", "3", "--test-arenas", "3", "--steps", "1", "--batch", "2", "--sweep", "1"]


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def small(monkeypatch):
    """Queues of few slots, which take less memory and no less time to compile."""
    monkeypatch.setattr(trials, "BLOCK", 4)
    monkeypatch.setattr(trials, "SLOTS", 8)


def equal(first, second):
    """Two results, leaf by leaf."""
    jax.tree.map(np.testing.assert_array_equal, first, second)


def test_tunes_writes_and_the_costs_can_be_used(here, small, capsys):
    """And the missions behind it: they do not depend on what they are played with."""
    assert cli.main(["tune", *TINY, "--out", "mine"]) == 0
    said = capsys.readouterr().out
    assert "tuned minus start" in said and "written mine: costs.toml" in said
    files = {"costs.toml", "history.parquet", "manifest.json", "summary.md", "sweep.parquet", "test.parquet"}
    assert {path.name for path in (here / "mine").iterdir()} == files | {"tune.png"}
    test = pl.read_parquet(here / "mine" / "test.parquet")
    assert len(test) == 4 * 3 and test["arena"].unique().to_list() == [0, 1, 2]
    costs = load(StudyConfig, here / "mine" / "costs.toml").mission.costs
    history = pl.read_parquet(here / "mine" / "history.parquet")
    assert costs.c0 == 1.0 and round(history["c4"][0], 9) == 100.0 and f"{costs.c3:.4g}" in said
    manifest = json.loads((here / "mine" / "manifest.json").read_text())
    assert manifest["config"]["steps"] == 1 and manifest["versions"]["jax"]

    play = Trials(MissionConfig(), "full", FAMILIES, 0)
    index, vectors = np.array([7, 2, 9, 2, 100_000_003]), PAPER * np.array([[1.0], [3.0], [0.5]])
    vectors[2, 1:] = [9.0, 9.0, 9.0, 0.1]
    together = play(vectors, index)
    assert together.code.shape == (3, 5)
    first, second = (jax.tree.map(lambda leaf, k=k: leaf[k], together) for k in (0, 1))  # costs, and thrice those
    np.testing.assert_allclose(second.planned.cost, 3 * first.planned.cost, rtol=1e-6)
    equal(first, replace(second, planned=replace(second.planned, cost=first.planned.cost)))
    equal(jax.tree.map(lambda leaf: leaf[:, 1], together), jax.tree.map(lambda leaf: leaf[:, 3], together))
    equal(jax.tree.map(lambda leaf: leaf[2:, 4:], together), play(vectors[2:], index[4:]))
    assert np.any(together.time[0] != together.time[2])
    assert play(vectors, index[:0]).code.shape == (3, 0)


@pytest.mark.slow
def test_missions_are_those_of_a_study(small):
    config = StudyConfig(arenas=6, strategies=("full",))
    rows = pl.concat([frame for _, frame in evaluate(config)]).sort("arena")
    result = Trials(MissionConfig(), "full", FAMILIES, 0)(PAPER[None], np.arange(6))
    np.testing.assert_array_equal(rows["elapsed"].to_numpy(), result.time[0])
    np.testing.assert_array_equal(rows["walked"].to_numpy(), result.distance[0])


def test_costs_from_durations(here, capsys):
    assert cli.main(["tune", "--from-durations", "table", "--out", "table"]) == 0
    said = capsys.readouterr().out
    row = next(line for line in said.splitlines() if line.startswith("straight moves"))
    assert row.split()[2:] == ["1.00", "1.00", "5.00", "11.00", "8.00", "0.0"] and "C4 cannot" in said
    written = tomllib.loads((here / "table" / "costs.toml").read_text())["mission"]["costs"]
    assert written == {"c0": 1.231, "c1": 0.7692, "c2": 3.741, "c3": 6.668, "c4": 100.0}
    assert cli.main(["tune", "--from-durations", "library", "--out", "library", "--durations.measure", "0"]) == 0
    assert "measured primitives" in capsys.readouterr().out
    assert load(StudyConfig, here / "library" / "costs.toml").mission.costs.c3 < 5  # its steps are quick


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["--arenas", "0"], ["--arenas", "greater than or equal to 1"]),
        (["--strategy", "blind_stop"], ["--strategy", "blind_stop", "bump_aware"]),
        (["--low", "5", "--high", "2"], ["high must be above low"]),
        (["--executor", "native"], ["kinematic or sampled"]),
        (["--pitch", "0.03"], ["pitch", "must divide", "0.03"]),
        (["--families", "bump", "bump"], ["must be distinct"]),
        (["--from-durations", "guess"], ["--from-durations", "guess", "library"]),
        (["--from-durations", "table", "--durations.straight", "0"], ["durations.straight", "above 0"]),
        (["--durations.straight", "0", "--durations.measure", "0"], ["durations.straight", "above 0"]),
        (["--from-durations", "library", "--library", "none.toml"], ["none.toml", "no such file"]),
        (["nothing.toml"], ["nothing.toml", "no such file"]),
        (["wrong.toml"], ["wrong.toml", "stepz", "unknown key"]),
        (["--out", "there"], ["there", "does not exist yet"]),
    ],
)
def test_wrong_input(here, capsys, argv, said):
    (here / "there").mkdir()
    (here / "wrong.toml").write_text("stepz = 5")
    assert cli.main(["tune", *argv]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("jaxbiped: ") and all(part in lines[0] for part in said), lines
    assert sorted(path.name for path in here.iterdir()) == ["there", "wrong.toml"]


def test_full_disk(here, capsys, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(files.os, "fsync", full)
    assert cli.main(["tune", "--from-durations", "table", "--out", "mine"]) == 2
    assert "no space left" in capsys.readouterr().err and not list(here.iterdir())
