"""Wrong input ends with one line and status 2, before anything is compiled or written."""

import errno
import json

import polars as pl
import pytest

from jaxbiped import cli, files
from jaxbiped.commands import compare, run
from jaxbiped.core.names import METRICS
from jaxbiped.mission.params import MissionConfig
from jaxbiped.sensing.config import CameraConfig
from jaxbiped.sensing.presets import PRESETS
from jaxbiped.statistics.schema import SCHEMA

SCENE = "configs/scenes/experiment_5.toml"


@pytest.fixture
def here(tmp_path, monkeypatch, request):
    """An empty working folder, with the repository's configs in reach."""
    (tmp_path / "configs").symlink_to(request.config.rootpath / "configs")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(capsys, *argv: str) -> str:
    """The one line that a command line is refused with."""
    assert cli.main(argv) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("jaxbiped: ")
    return lines[0]


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["walk"], ["must be one of " + ", ".join(cli.COMMANDS), "walk"]),
        (["run"], ["PATH: must be given; `jaxbiped run --help-all` lists"]),
        (
            ["run", SCENE, "--strateg", "full"],
            ["--strateg: is not an option of jaxbiped run; did you mean --strategy?"],
        ),
        (["run", SCENE, "again", "3"], ["again: is an unexpected argument; `jaxbiped run --help-all` lists"]),
        (
            ["run", SCENE, "--executor", "feet"],
            ["--executor: must be one of kinematic, sampled, native, mjx", "or package.module:name", "(got 'feet')"],
        ),
        (["stereo", "left.png"], ["RIGHT, --camera FILE: must be given"]),
        (["plan", "a.map", "--start", "1"], ["--start: must be 2 numbers (got 1)"]),
        (["plan", "a.map", "--goal", "a", "b"], ["--goal: must be 2 numbers (got a b)"]),
        (["classify", "a.ply", "--up", "0", "0"], ["--up: must be 3 numbers (got 0 0)"]),
        (["classify", "a.ply", "--pitch", "nan"], ["--pitch: must be a finite number (got nan)"]),
        (["compare", "--families"], ["--families: must have at least 1 item (got ())"]),
        (["sweep", "--no-such"], ["options: cannot be used; `jaxbiped sweep --help-all` lists", "--no-such"]),
        (["run", SCENE, "--speed", "3"], ["--speed: is not an option of jaxbiped run; did you mean --seed?"]),
        (["run", SCENE, "--strategy", "brave"], ["--strategy", "brave", "floor_only"]),
        (["run", SCENE, "--costs.c1", "-4"], ["--costs.c1", "greater than or equal to 0", "-4"]),
        (["run", SCENE, "--costs.c1", "nan"], ["--costs.c1", "finite", "nan"]),
        (["run", SCENE, "--costs.c1", "cheap"], ["--costs.c1: must be a number (got 'cheap')"]),
        (["run", SCENE, "--camera.width", "wide"], ["--camera.width: must be a whole number (got 'wide')"]),
        (["run", SCENE, "--preset", "best"], ["--preset: must be one of ideal, rendered, real or a .toml file"]),
        (["run", SCENE, "--preset"], ["--preset: must be given a value"]),
        (["run", SCENE, "--seed", "-1"], ["--seed", "greater than or equal to 0"]),
        (["run", SCENE, "--pitch", "0.03"], ["pitch", "must divide", "0.03"]),
        (["run", SCENE, "--robot.standing", "0.2"], ["--robot", "must rise"]),
        (["run", SCENE, "--camera.columns", "60"], ["--camera", "must divide"]),
        (["run", "missing.toml"], ["missing.toml", "no such file"]),
        (["compare", "missing.toml"], ["missing.toml", "no such file"]),
        (["compare", "--arenas", "0"], ["--arenas", "greater than or equal to 1"]),
        (["compare", "--pitch", "0.03"], ["pitch", "must divide", "0.03"]),
        (["compare", "--strategies", "full", "full"], ["must be distinct"]),
        (["compare", "--sensor", "lidar"], ["--sensor", "lidar", "raycast"]),
        (["compare", "--executor", "robot"], ["--executor", "robot", "kinematic"]),
        (["compare", "--planner", "lattice"], ["--planner", "lattice", "heading"]),
        (["run", SCENE, "--foot-placement", "perhaps"], ["--foot-placement", "perhaps", "False"]),
        (["compare", "--until-width", "0"], ["--until-width", "greater than 0"]),
        (["compare", "--until-width", "2"], ["until-width", "below 2 for success", "2.0"]),
        (["compare", "--until-width", "0.1", "--first", "brave"], ["first:", "brave", "floor_only"]),
        (["compare", "--strategies", "full", "--until-width", "0.1"], ["first", "at least two"]),
        (
            ["compare", "--strategies", "full", "floor_only", "--until-width", "1", "--second", "blind_stop"],
            ["second", "blind_stop"],
        ),
        (["compare", "--until-width", "0.1", "--first", "full", "--second", "full"], ["must differ"]),
        (["compare", "--first", "full"], ["first", "--until-width"]),
        (["report", "nowhere"], ["nowhere"]),
        (["sweep"], ["needs [[axes]] or [sobol]"]),
        (["sweep", "missing.toml"], ["missing.toml", "no such file"]),
    ],
)
def test_options(here, capsys, argv, said):
    line = refused(capsys, *argv)
    assert all(part in line for part in said), line
    assert sorted(path.name for path in here.iterdir()) == ["configs"]


@pytest.fixture
def mission_of(monkeypatch):
    """The options that a command line is read as, without the command."""
    taken = []
    monkeypatch.setattr(run, "main", lambda args: taken.append(args) or 0)
    monkeypatch.setattr(compare, "main", lambda args: taken.append(args) or 0)

    def mission_of(*argv):
        assert cli.main(argv) == 0
        return taken[-1].mission

    return mission_of


RAYS = "[rays]\ncolumns = 80\nrows = 60\n[stereo]\nsd = 0.3\n"


@pytest.mark.parametrize("join", [False, True])
def test_a_preset_with_rays_and_a_camera_go_together_as_in_toml(here, capsys, mission_of, join):
    """The rays of a preset need only divide the camera's size as it is given; what is given beside the preset wins."""
    (here / "rays.toml").write_text(RAYS)

    def words(**options):
        pairs = [(f"--{name.replace('_', '.', 1)}", value) for name, value in options.items()]
        return [f"{name}={value}" for name, value in pairs] if join else [word for pair in pairs for word in pair]

    for given in ({"width": 640, "height": 480}, {"width": 800, "height": 600, "rows": 30}):
        options = {f"camera_{name}": str(value) for name, value in given.items()}
        on_line = mission_of("run", SCENE, *words(**options, preset="rays.toml"))
        table = ", ".join(f"{name} = {value}" for name, value in given.items())
        (here / "study.toml").write_text(f"[mission]\npreset = 'rays.toml'\ncamera = {{ {table} }}\n")
        in_file = mission_of("compare", "study.toml")
        assert on_line == in_file == mission_of("compare", "study.toml", *words(**options))
        camera = on_line.camera.model_dump()
        assert camera == CameraConfig(**{"columns": 80, "rows": 60} | given).model_dump() and on_line.stereo.sd == 0.3
    line = refused(capsys, "run", SCENE, *words(preset="rays.toml"))
    assert "--camera: columns must divide the width of 512, got 80" in line


@pytest.mark.parametrize(
    ("option", "value", "part", "name"),
    [
        ("preset", "real", "stereo", "sd"),
        ("executor", "sampled", "robot", "radius"),
        ("sensor", "stereo", "mapping", "below_points"),
    ],
)
def test_options_that_decide_defaults_do_so_in_both_spellings(here, mission_of, option, value, part, name):
    expected = getattr(getattr(MissionConfig(**{option: value}), part), name)
    assert expected != getattr(getattr(MissionConfig(), part), name)
    for words in ([f"--{option}", value], [f"--{option}={value}"]):
        assert getattr(getattr(mission_of("run", SCENE, *words), part), name) == expected, words


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("arenas = 'many'", ["study.toml", "arenas", "many"]),
        ("arena = 5", ["study.toml", "arena:", "unknown key"]),
        ("families = ['bump', 'hole']", ["study.toml", "families.1", "hole"]),
        ("[mission.costs]\nc1 = nan", ["study.toml", "mission.costs.c1", "finite"]),
        ("[mission.costs]\nc5 = 1", ["study.toml", "mission.costs.c5", "unknown key"]),
        ("[mission]\npitch = -1", ["study.toml", "mission.pitch", "greater than 0"]),
        ("arenas = ", ["study.toml", "not valid TOML"]),
    ],
)
def test_study_file(here, capsys, text, said):
    (here / "study.toml").write_text(text)
    line = refused(capsys, "compare", "study.toml")
    assert all(part in line for part in said), line


def test_no_text(here, capsys):
    (here / "study.toml").write_bytes(b"\xff\xfe\x00")
    assert "cannot be read as text" in refused(capsys, "compare", "study.toml")


@pytest.mark.parametrize("command", [["run", SCENE], ["compare", "--arenas", "6"]])
def test_folder_that_exists(here, capsys, command):
    (here / "mine").mkdir()
    (here / "mine" / "work.txt").write_text("precious")
    line = refused(capsys, *command, "--out", "mine")
    assert "mine" in line and "out" in line
    assert (here / "mine" / "work.txt").read_text() == "precious"


def full_disk(*_, **__):
    raise OSError(errno.ENOSPC, "No space left on device")


def test_full_disk_while_running(here, capsys, monkeypatch):
    monkeypatch.setattr(files.os, "fsync", full_disk)
    assert cli.main(["run", SCENE, "--out", "mine"]) == 2
    assert "mine" in (line := capsys.readouterr().err.strip()) and "space" in line.lower() and "\n" not in line
    assert sorted(path.name for path in here.iterdir()) == ["configs"]


def test_full_disk_while_comparing(here, capsys, monkeypatch):
    monkeypatch.setattr(files.os, "fsync", full_disk)
    assert "space" in refused(capsys, "compare", "--arenas", "6", "--out", "mine").lower()
    assert sorted(path.name for path in here.iterdir()) == ["configs"]


def test_run_writes_its_folder(here, capsys):
    assert cli.main(["run", SCENE, "--out", "mine"]) == 0
    printed = capsys.readouterr().out
    assert "Step-up-bump" in printed and "reached" in printed
    assert {path.name for path in (here / "mine").iterdir()} == {
        "map.png",
        "mission.gif",
        "mission.json",
        "mission.npz",
    }
    told = json.loads((here / "mine" / "mission.json").read_text())
    assert told["code"] == "reached" and f"{100 * told['distance']:.0f} cm" in printed


def test_compare_writes_its_folder_and_report_reads_it(here, capsys):
    argv = ["compare", "--arenas", "24", "--strategies", "full", "floor_only", "--out", "mine"]
    assert cli.main(argv) == 0
    rows = pl.read_parquet(here / "mine" / "rows")
    assert rows.schema == {**SCHEMA, **dict.fromkeys(METRICS, pl.Float64)} and len(rows) == 48
    manifest = json.loads((here / "mine" / "manifest.json").read_text())
    assert manifest["state"] == "finished" and manifest["arenas"] == 24 and "out" not in manifest["config"]
    summary = (here / "mine" / "summary.md").read_text()
    assert cli.main(["report", "mine", "--examples", "0"]) == 0
    assert (here / "mine" / "summary.md").read_text() == summary
    assert "full" in capsys.readouterr().out


@pytest.fixture
def parsed(here, monkeypatch):
    """The options that a command line of `compare` comes to."""
    from jaxbiped.commands import compare

    def parse(*argv: str):
        caught = []
        monkeypatch.setattr(compare, "main", lambda args: caught.append(args) or 0)
        assert cli.main(["compare", *argv]) == 0
        return caught[0].mission

    (here / "real.toml").write_text("[mission]\npreset = 'real'\n[mission.stereo]\nsd = 0.5\n")
    return parse


def test_presets_are_defaults_field_by_field(parsed):
    real, ideal = PRESETS["real"].stereo, PRESETS["ideal"].stereo
    assert parsed().stereo == PRESETS["rendered"].stereo
    assert parsed("--preset", "real").stereo == real
    assert parsed("--preset", "real", "--stereo.bias", "0.33").stereo == real.model_copy(update={"bias": 0.33})
    assert parsed("real.toml").stereo == real.model_copy(update={"sd": 0.5})
    assert parsed("real.toml", "--preset", "ideal").stereo == ideal.model_copy(update={"sd": 0.5})
    assert parsed("real.toml", "--preset", "ideal").landmarks == PRESETS["ideal"].landmarks


def test_switches_past_the_paper(here, parsed):
    assert parsed().planner == "cell" and parsed().foot_placement is None
    mission = parsed("--planner", "heading", "--executor", "native", "--foot-placement", "False")
    assert mission.planner == "heading" and mission.foot_placement is False
    (here / "study.toml").write_text("[mission]\nplanner = 'heading'\nfoot_placement = true\n")
    assert parsed("study.toml").foot_placement is True


@pytest.mark.parametrize("command", sorted(cli.COMMANDS))
def test_help(command, capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main([command, "--help"])
    assert stop.value.code == 0 and "usage: jaxbiped " + command in capsys.readouterr().out


def test_usage(capsys):
    assert cli.main(["--help"]) == 0 and "compare" in capsys.readouterr().out
    assert cli.main([]) == 2
    assert cli.main(["--version"]) == 0


def test_a_sensor_file_is_a_preset(here, parsed, capsys):
    (here / "mine.toml").write_text("[stereo]\nsd = 0.3\n[landmarks]\nsd = 0.001\n")
    mine = parsed("--preset", "mine.toml", "--stereo.bias", "0.2")
    assert (mine.stereo.sd, mine.stereo.bias, mine.landmarks.sd) == (0.3, 0.2, 0.001)
    assert mine.stereo.edge_swap == PRESETS["rendered"].stereo.edge_swap
    line = refused(capsys, "run", SCENE, "--preset", "best")
    assert "preset" in line and "ideal, rendered, real or a .toml file" in line and line.count("best") == 1
    assert "no such file" in refused(capsys, "run", SCENE, "--preset", "nowhere.toml")


NASTY = [
    *(["--no-such"], ["--no-such=3"], ["--out"], ["--seed", "abc"], ["--seed="], ["--seed", "-1"], ["--seed", "nan"]),
    *(["a", "b", "c", "d"], ["--out", "a", "b"], ["--robot.step", "x"], ["--pitch", "-1"], ["--executor", "feet"]),
]
OF_LIBRARIES = (
    "Unrecognized",
    "Expected",
    "Missing",
    "Error parsing",
    "Input should",
    "type=",
    "tyro",
    "pydantic",
    "np.",
)


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_no_text_of_a_library_is_in_a_message(here, capsys, command):
    """Whatever is wrong with the options: the field, and what is allowed, in our words."""
    for words in NASTY:
        said = refused(capsys, command, *words)
        assert not [text for text in OF_LIBRARIES if text in said] and ": " in said.removeprefix("jaxbiped: "), said
