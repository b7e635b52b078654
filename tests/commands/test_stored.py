"""`jaxbiped compare FOLDER`: what it prints and writes, and what it refuses in one line."""

import json

import pytest

from jaxbiped import cli
from tests.commands.test_cli import refused
from tests.report.html_reader import Reader
from tests.study.test_stored_series import stored

FEW = ("--resamples", "50")


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A working folder with results: one point, three points, and one point on other arenas."""
    monkeypatch.chdir(tmp_path)
    stored(tmp_path / "r")
    stored(tmp_path / "swept", points=3)
    stored(tmp_path / "other", seed=7)
    return tmp_path


def test_two_strategies(here, capsys):
    before = sorted(here.rglob("*"))
    assert cli.main(["compare", "r", "--first", "full", "--second", "floor_only", *FEW]) == 0
    printed = capsys.readouterr().out
    assert "full - floor_only by family" in printed and "full - floor_only by difficulty" in printed
    assert "p (Holm)" in printed and "Over all arenas" in printed and "Equivalence" not in printed
    assert sorted(here.rglob("*")) == before  # nothing is written


def test_two_points_with_everything_asked_for(here, capsys):
    asked = ["--first-point", "2", "--margin-success", "0.05", "--margin-distance", "0.1", "--margin-time", "90"]
    asked += ["--plan-power", "--wanted-difference", "0.1", "--out", "out"]
    assert cli.main(["compare", "swept", *asked[:2], "--second-point", "0", *asked[2:], *FEW]) == 0
    printed = capsys.readouterr().out
    assert "full (c3 20)" in printed and "Equivalence in time, margin 1.5 min" in printed
    assert "arenas would show a difference of 10 points in success" in printed
    text = (here / "out" / "comparison.md").read_text()
    assert "Equivalence in success, margin 5 points" in text and "jaxbiped compare --seed 0" in text
    page = Reader((here / "out" / "report.html").read_text())
    assert "full (c3 20)" in page.text and "Are they equivalent?" in page.text and "How many arenas next" in page.text
    assert {path.name for path in (here / "out").iterdir()} == {"comparison.md", "report.html"}


def test_two_folders(here, capsys):
    stored(here / "longer", arenas=90)
    assert cli.main(["compare", "r", "longer", "--first", "full", "--second", "full", *FEW]) == 0
    printed = capsys.readouterr().out
    assert "full (r) - full (longer)" in printed and "30 arenas that only one side has" in printed


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["configs"], ["configs", "is not a results folder"]),
        (["r", "nowhere"], ["nowhere", "no such results folder"]),
        (["r", "other"], ["other", "seeds differ", "0 in r, 7 here"]),
        (["r", "r", "r"], ["folders", "at most 2"]),
        (["r", "--first", "brave"], ["first:", "brave", "floor_only"]),
        (["r", "--first", "blind_stop"], ["r: first", "must be one of full, bump_aware, floor_only", "blind_stop"]),
        (["r", "--first", "full", "--second", "full"], ["must differ from the first side"]),
        (["r", "--second-point", "1"], ["r: second-point", "must be 0, the only point"]),
        (["swept", "--first-point", "3"], ["first-point", "0 to 2"]),
        (["swept", "--first-point", "-1"], ["--first-point", "greater than or equal to 0"]),
        (["r", "--margin-success", "0"], ["--margin-success", "greater than 0"]),
        (["r", "--margin-success", "1"], ["--margin-success", "less than 1"]),
        (["r", "--margin-time", "-5"], ["--margin-time", "greater than 0"]),
        (["r", "--plan-power"], ["wanted-difference", "go together"]),
        (["r", "--wanted-difference", "0.1"], ["plan-power", "go together"]),
        (["r", "--plan-power", "--wanted-difference", "2"], ["wanted-difference", "below 1"]),
        (["r", "--power", "1"], ["--power", "less than 1"]),
        (["r", "--level", "95"], ["--level", "less than 1"]),
        (["r", "--arenas", "10"], ["--arenas: is not an option"]),
        (["r", "--out", "swept"], ["out", "does not exist yet", "swept"]),
    ],
)
def test_refused(here, capsys, argv, said):
    (here / "configs").mkdir()
    line = refused(capsys, "compare", *argv)
    assert all(part in line for part in said), line


def test_damaged_results_are_named(here, capsys):
    shard = next((here / "r" / "rows").glob("*.parquet"))
    whole = shard.read_bytes()
    shard.write_bytes(whole[: len(whole) // 2])
    assert "part-00000.parquet" in (line := refused(capsys, "compare", "r")) and "damaged" in line
    assert "part-00000.parquet" in refused(capsys, "report", "r")
    shard.unlink()
    assert "the manifest says 1 with 180" in refused(capsys, "compare", "r")
    manifest = json.loads((here / "swept" / "manifest.json").read_text())
    (here / "swept" / "manifest.json").write_text(json.dumps(manifest | {"format": 99}))
    assert "manifest.json" in (line := refused(capsys, "compare", "swept")) and "99" in line
