"""`jaxbiped primitives`: what it writes, and what it refuses."""

import json

import polars as pl
import pytest
from PIL import Image

from jaxbiped import cli
from jaxbiped.biped.spread import SETS
from jaxbiped.commands import primitives
from jaxbiped.config import load
from jaxbiped.errors import InputError
from jaxbiped.executors.motion_library import DEFAULT, PLAYED, LibraryConfig, load_library
from jaxbiped.report import video
from tests.commands.test_cli import SCENE, here, refused

__all__ = ["here"]
SMALL = ["--pace", "fast", "--draws", "4", "--only", "step_up", "stand"]


@pytest.fixture(autouse=True)
def few_probes(monkeypatch):
    """A few disturbances by themselves, and a small window."""
    limits = {name: (unit, values[:1]) for name, (unit, values) in primitives.LIMITS.items()}
    monkeypatch.setattr(primitives, "LIMITS", limits)
    monkeypatch.setattr(primitives, "WINDOW_EDGE", [-0.035, 0.0, 0.035])
    monkeypatch.setattr(primitives, "WINDOW_YAW", [-20.0, 0.0])
    monkeypatch.setattr(video, "FRAMES_PER_SECOND", 2.0)


def test_it_writes_its_folder(here, capsys):
    assert cli.main(["primitives", *SMALL, "--out", "mine"]) == 0
    printed = capsys.readouterr().out
    assert "Success" in printed and "step up" in printed and "written mine" in printed
    names = {str(path.relative_to(here / "mine")) for path in (here / "mine").rglob("*") if path.is_file()}
    assert {"trials.parquet", "manifest.json", "library.toml", "summary.md", "windows.png"} <= names
    rows = pl.read_parquet("mine/trials.parquet")
    sets = dict(rows.filter(pl.col("primitive") == "step_up").group_by("set").len().iter_rows())
    assert sets["nominal"] == 1 and sets["mild"] == sets["hard"] == 4 and sets["window"] == 6
    assert rows.filter(pl.col("set").is_in(["nominal", "mild"]))["success"].all()
    assert not rows.filter(pl.col("set") == "window")["success"].all()
    manifest = json.loads((here / "mine" / "manifest.json").read_text())
    assert manifest["sets"]["hard"]["servo"] == SETS["hard"].servo and manifest["config"]["seed"] == 0
    summary = (here / "mine" / "summary.md").read_text()
    assert "Wilson" in summary and "[0.4, 1.2]" in summary and "4 trials of each set" in summary
    for name in ("step_up", "stand"):
        with Image.open(f"mine/videos/{name}.gif") as shown:
            assert shown.n_frames >= 5
            first = shown.convert("RGB").tobytes()
            shown.seek(shown.n_frames // 2)
            assert shown.convert("RGB").tobytes() != first


def test_the_same_seed_is_the_same_library(here):
    for out, seed in (("a", "1"), ("b", "1"), ("c", "2")):
        assert cli.main(["primitives", *SMALL[:4], "--only", "stand", "--no-videos", "--seed", seed, "--out", out]) == 0
    a, b, c = (pl.read_parquet(f"{out}/trials.parquet") for out in "abc")
    assert a.equals(b) and not a.equals(c)
    one, other = ((here / out / "library.toml").read_text().splitlines() for out in "ab")
    assert [line for line in one if not line.startswith("command")] == [
        line for line in other if not line.startswith("command")
    ]


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["--only", "jump"], ["--only", "jump", "straight"]),
        (["--draws", "0"], ["--draws", "greater than or equal to 1"]),
        (["--pace", "slow"], ["--pace", "slow", "paper"]),
        (["--backend", "warp"], ["--backend", "warp"]),
        (["--robot", "missing.toml"], ["missing.toml", "no such file"]),
        (["--robot", "tall.toml"], ["tall.toml", "straight leg"]),
        (["--robot", "weak.toml", "--only", "turn"], ["turn", "torque at"]),
        (["--robot", "stiff.toml", "--only", "step_up"], ["step up", "knee_pitch", "range at"]),
        (["--backend", "mjx", "--device", "tpu", "--only", "stand"], ["device", "tpu", "JAX sees"]),
        (["--against", "mjx", "--device", "tpu", "--only", "stand"], ["device", "tpu", "JAX sees"]),
        (["--bump", "0.05", "--only", "step_up"], ["--bump", "step height, 0.03 m", "0.05"]),
        (["--bump", "-0.01"], ["--bump", "greater than 0"]),
        (["--gate", "0.33", "--only", "gate"], ["--gate", "squatting robot's head, 0.34 m", "0.33"]),
        (["--robot", "high.toml", "--only", "gate"], ["--gate", "squatting robot's head, 0.375 m", "0.37"]),
    ],
)
def test_what_it_refuses(here, capsys, argv, said):
    (here / "tall.toml").write_text("[stance]\nstanding = 0.3\n")
    (here / "high.toml").write_text("[stance]\nsquatting = 0.19\nclimbing = 0.19\nwalking = 0.19\n")
    (here / "weak.toml").write_text("[servo]\ntorque = 1.0\n")
    (here / "stiff.toml").write_text("[ranges]\nknee_pitch = [0.0, 60.0]\n")
    line = refused(capsys, "primitives", *argv)
    assert all(part in line for part in said), line
    assert not (here / "results").exists()


def test_a_folder_that_exists(here, capsys):
    (here / "mine").mkdir()
    assert "does not exist yet" in refused(capsys, "primitives", *SMALL, "--out", "mine")


def test_against_another_backend(here, capsys, monkeypatch):
    """What it prints, and its status: with `native` in the place of `mjx`, which takes long."""
    monkeypatch.setattr(primitives, "HARD_CASES", 6)
    assert primitives.main(primitives.PrimitivesArgs.model_construct(
        **primitives.PrimitivesArgs(pace="fast", only=("step_up",), against="mjx").model_dump() | {"against": "native"}
    )) == 0  # fmt: skip
    printed = " ".join(capsys.readouterr().out.split())
    assert "at most 0.00 mm apart" in printed and "6 hard steps up" in printed and "the same in 6" in printed
    assert not (here / "results").exists()


def test_a_library_that_is_not_there(here, capsys):
    line = refused(capsys, "run", SCENE, "--executor", "sampled", "--library", "missing.toml")
    assert "missing.toml" in line and "no such file" in line


def test_the_shipped_library_is_whole():
    library = load_library()
    assert set(PLAYED) <= set(library.primitives) and library.command.startswith("jaxbiped primitives")
    assert all(one.falls == 0 for one in library.primitives.values())  # on the mild set
    traced = library.traced()
    assert traced.stands.shape == (2, len(traced.edge), len(traced.yaw))
    middle = traced.stands[:, len(traced.edge) // 2, len(traced.yaw) // 2]
    assert (middle == 1).all() and traced.stands[:, 0].max() == 0 == traced.stands[:, -1].max()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("falls = 0", "falls = 9999"), "falls, slips and touches"),
        (("[primitives.turn]", "[primitives.spin]"), "missions also play turn"),
        (("trials =", "tries ="), "trials"),
        (("yaw = [", "yaw = [9.9, "), "stands must have one row"),
    ],
)
def test_a_library_that_cannot_be_right(tmp_path, change, said):
    file = tmp_path / "library.toml"
    file.write_text(DEFAULT.read_text().replace(*change))
    with pytest.raises(InputError, match=said):
        load(LibraryConfig, file)


@pytest.mark.slow
def test_what_was_optimised_is_verified_like_all_else(here, capsys):
    command = [
        "primitives",
        "--pace",
        "fast",
        "--only",
        "turn",
        "--draws",
        "2",
        "--no-videos",
    ]
    assert cli.main([*command, "--optimise", "duration", "--out", "quick"]) == 0
    assert cli.main([*command, "--out", "plain"]) == 0
    quick, plain = (pl.read_parquet(f"{out}/trials.parquet") for out in ("quick", "plain"))
    assert quick.filter(pl.col("set").is_in(["nominal", "mild"]))["success"].all()
    assert quick["simulated"][0] < plain["simulated"][0]
