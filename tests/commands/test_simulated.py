"""Simulated bipeds from the command line: refused with one line before anything is written, or walked."""

import json

import jax
import polars as pl
import pytest

from jaxbiped import cli
from jaxbiped.commands import run
from jaxbiped.mission.params import SWAYING, MissionConfig
from jaxbiped.motion.config import RobotConfig

SCENE = """
name = "short"
size = [0.9, 0.6]
start = [0.25, 0.3, 0.0]
goal = [0.45, 0.3]
"""


@pytest.fixture
def scene(tmp_path, monkeypatch):
    """A short way on an empty floor, in an empty working folder."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "short.toml"
    path.write_text(SCENE)
    return str(path)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["mjx", "--walk.device", "gpu"], ["device", "no such device is there", "cpu"]),
        (["mjx", "--walk.impl", "warp"], ["impl", "warp-lang"]),
        (["native", "--walk.device", "gpu"], ["native runs on a CPU"]),
        (["native", "--walk.threads", "-1"], ["--walk.threads", "greater than or equal to 0"]),
        (["native", "--walk.pace", "slow"], ["--walk.pace", "slow", "fast"]),
        (["native", "--walk.biped.stance.standing", "0.21"], ["robot.standing", "at least", "0.395"]),
        (["native", "--walk.biped.servo.speed", "20"], ["leaves its speed", "deg/s"]),
    ],
)
@pytest.mark.parametrize("command", ["run", "compare"])
def test_what_cannot_be_simulated_is_refused_with_one_line(scene, capsys, tmp_path, command, options, said):
    if "warp" in options and not missing("warp"):
        pytest.skip("warp-lang is installed")
    if "mjx" in options and "gpu" in options and jax.default_backend() == "gpu":
        pytest.skip("a GPU is there")
    argv = [command, *([scene] if command == "run" else ["--arenas", "2"]), "--executor", *options, "--out", "out"]
    assert cli.main(argv) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("jaxbiped: ")
    assert all(part in lines[0] for part in said), lines[0]
    assert not (tmp_path / "out").exists()


def test_who_sways_keeps_further_off_by_default(scene, monkeypatch):
    seen = []
    monkeypatch.setattr(run, "main", lambda args: seen.append(args.mission.robot.radius) or 0)
    for options in ([], ["--executor", "native"], ["--executor", "native", "--robot.radius", "0.11"]):
        assert cli.main(["run", scene, *options]) == 0
    assert seen == [0.10, SWAYING, 0.11]
    assert MissionConfig(executor="mjx", robot={"standing": 0.39}).robot.radius == SWAYING
    assert MissionConfig(executor="mjx", robot=RobotConfig(standing=0.39)).robot.radius == SWAYING
    assert MissionConfig(executor="native", robot=RobotConfig(radius=0.10)).robot.radius == 0.10


def missing(package):
    try:
        __import__(package)
    except ImportError:
        return True
    return False


@pytest.mark.slow
def test_run_walks_a_scene(scene, capsys, tmp_path):
    small = ["--camera.columns", "32", "--camera.rows", "24"]
    assert cli.main(["run", scene, "--executor", "native", "--out", "out", *small]) == 0
    assert "executor native" in (said := capsys.readouterr().out) and "reached: 1" in said
    mission = json.loads((tmp_path / "out/mission.json").read_text())
    assert mission["code"] == "reached" and mission["config"]["executor"] == "native"


@pytest.mark.slow
def test_compare_tabulates_simulated_missions(scene, tmp_path):
    small = ["--camera.columns", "32", "--camera.rows", "24", "--families", "obstacles", "--strategies", "full"]
    assert cli.main(["compare", "--arenas", "2", "--executor", "native", "--out", "out", *small]) == 0
    rows = pl.read_parquet("out/rows")
    assert rows.height == 2
    assert set(rows["code"]) <= {"reached", "no_path", "stuck", "collided", "fell", "out_of_steps"}
    assert (rows["walked"] > 0.1).all()
