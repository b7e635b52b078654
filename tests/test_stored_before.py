"""What earlier versions stored, or people wrote for them, loads: `tests/data/stored_before`, made by commit f922b07."""

import shutil
from pathlib import Path

import numpy as np
import pytest

import jaxbiped as jb
from jaxbiped import cli
from jaxbiped.arenas import load_scene
from jaxbiped.config import load
from jaxbiped.core import class_grid
from jaxbiped.motion.config import RobotConfig
from jaxbiped.sensing.config import CameraConfig
from jaxbiped.sensing.presets import SensorConfig
from jaxbiped.study.config import StudyConfig
from jaxbiped.study.sweep import SweepConfig

STORED = Path(__file__).parent / "data" / "stored_before"


@pytest.fixture
def stored(tmp_path, monkeypatch):
    """A copy, in the working directory."""
    shutil.copytree(STORED, tmp_path / "stored")
    monkeypatch.chdir(tmp_path / "stored")
    return tmp_path / "stored"


def test_rows_and_points_load(stored):
    rows = jb.load(stored / "compare").rows
    assert rows.shape[0] == 8 and rows["strategy"].unique().sort().to_list() == ["floor_only", "full"]
    assert rows["success"].sum() == 7 and rows["walked"].null_count() + rows["elapsed"].null_count() == 0
    assert rows.filter("success")["distance"].null_count() + rows.filter("success")["time"].null_count() == 0
    assert set(rows["code"]) == {"reached", "no_path"} and rows["arena"].n_unique() == 4
    assert {"planning_calls", "planning_time", "plan_cost"} <= set(rows.columns)  # which were not known then
    swept = jb.load(stored / "sweep")
    assert swept.rows.group_by("point").len()["len"].to_list() == [4, 4] and "c3" in str(swept)


def test_folders_are_compared_and_reported(stored, capsys):
    assert cli.main(["compare", "compare"]) == 0
    assert "full" in capsys.readouterr().out
    for name in ("compare", "sweep"):
        (stored / name / "report.html").unlink(missing_ok=True)
        assert cli.main(["report", name]) == 0 and (stored / name / "report.html").stat().st_size > 10_000


def test_a_stopped_study_of_an_earlier_program_is_not_mixed_with_rows_of_this_one(stored, capsys):
    """Missions have changed since, with how heights are judged: one line says in what, and nothing is lost."""
    manifest = stored / "compare" / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"finished"', '"stopped"'))
    before = jb.load(stored / "compare").rows
    words = ["compare", "--arenas", "4", "--shard", "2", "--strategies", "full", "floor_only", "--out", "compare"]
    assert cli.main([*words, "--resume"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "was started with another config" in said and "height_tolerance" in said
    assert jb.load(stored / "compare").rows.equals(before)


def test_class_grids_load(stored):
    grid = class_grid.load(stored / "classes.npz")
    assert grid.shape == (6, 9) and grid.pitch == 0.05 and (grid.origin_xy == [-0.2, 0.1]).all()
    assert grid.classes[2, 3] == 4 and (grid.levels == (grid.classes == 2)).all() and np.unique(grid.classes).size == 5


@pytest.mark.parametrize(
    ("name", "model"),
    [
        ("sensor", SensorConfig),
        ("camera", CameraConfig),
        ("robot", RobotConfig),
        ("study", StudyConfig),
        ("sweep", SweepConfig),
    ],
)
def test_configs_load(stored, recwarn, name, model):
    given = load(model, stored / f"{name}.toml")
    assert given.model_fields_set and not [w for w in recwarn if "jaxbiped" in str(w.filename)]


def test_scenes_load(stored):
    name, arena = load_scene(stored / "scene.toml")
    assert name and arena.boxes.used.sum() > 0
