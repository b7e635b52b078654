"""`jaxbiped reproduce` from the command line: refused with one line, or played at low and at full fidelity."""

import json

import pytest

from jaxbiped import cli
from jaxbiped.reproduction import EXPERIMENTS
from tests.report.html_reader import Reader

SMALL = ("--repeats", "1", "--draws", "0", "--population", "0", "--walked", "0")


@pytest.fixture
def here(tmp_path, monkeypatch, request):
    """An empty working folder, with the repository's configs in reach."""
    (tmp_path / "configs").symlink_to(request.config.rootpath / "configs")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["--scenes", "nowhere"], ["--scenes", "nowhere", "configs/scenes"]),
        (["--scenes", "."], ["experiment_1.toml", "no such file"]),
        (["--repeats", "0"], ["--repeats", "greater than or equal to 1"]),
        (["--seed", "-1"], ["--seed", "greater than or equal to 0"]),
        (["--sensor", "lidar"], ["--sensor", "lidar", "stereo"]),
        (["--population", "-5"], ["--population", "greater than or equal to 0"]),
        (["--out", "."], ["out", "does not exist"]),
    ],
)
def test_wrong_input_is_refused_with_one_line(here, capsys, argv, said):
    assert cli.main(["reproduce", *argv]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and all(part in lines[0] for part in said), lines


@pytest.mark.slow
def test_low_fidelity(here, capsys):
    """Kinematic missions, ray-cast: all tables but those of physics, and nothing hangs."""
    argv = ["reproduce", "--executor", "kinematic", "--sensor", "raycast", *SMALL, "--population", "40"]
    assert cli.main([*argv, "--out", "out"]) == 0
    assert "written out: reproduction.html" in capsys.readouterr().out.replace("\n", " ")
    told = json.loads((here / "out/reproduction.json").read_text())
    assert [each["shown"]["code"] for each in told["experiments"]] == ["reached"] * len(EXPERIMENTS)
    assert all(each["named"] for each in told["what_cannot_work"])
    passed = {(each["strategy"], each["scene"].removeprefix("table_1_")) for each in told["table_1"] if each["passed"]}
    assert {("full", "both"), ("bump_aware", "bump"), ("gate_aware", "gate"), ("floor_only", "obstacle")} <= passed
    assert (
        not {("bump_aware", "gate"), ("gate_aware", "bump"), ("floor_only", "bump"), ("blind_stop", "obstacle")}
        & passed
    )
    text = Reader((here / "out/reproduction.html").read_text()).text
    assert "The paper's own case saved 48 cm and 7.0 min" in text and "was not simulated" in text


@pytest.mark.slow
def test_full_fidelity(here):
    """Rendered stereo and a simulated biped: every experiment reaches its goal, and the robot is in the page."""
    assert cli.main(["reproduce", *SMALL, "--out", "out"]) == 0
    told = json.loads((here / "out/reproduction.json").read_text())
    assert [each["shown"]["code"] for each in told["experiments"]] == ["reached"] * len(EXPERIMENTS)
    crossing, detour = told["experiments"][4]["shown"], told["experiments"][3]["shown"]
    assert crossing["distance"] == pytest.approx(0.85, abs=0.10)
    assert detour["distance"] > crossing["distance"] + 0.4 and detour["time"] > crossing["time"] + 180
    read = Reader((here / "out/reproduction.html").read_text())
    shots = [each["alt"] for tag, each in read.elements if tag == "img" and each["src"].startswith("data:image/jpeg")]
    assert any(said.startswith("Squatting under the lintel") for said in shots)
    assert sum(said.startswith("Stepping") for said in shots) == 12
