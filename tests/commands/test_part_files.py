"""`--robot FILE` and `--camera FILE`: one rule for the command line, TOML and Python; what is given beside wins."""

import importlib

import pytest

from jaxbiped import cli
from jaxbiped.commands import reproduce
from jaxbiped.config import config_hash, load
from jaxbiped.errors import InputError
from jaxbiped.mission.config import MissionConfig
from jaxbiped.motion.config import RobotConfig
from jaxbiped.sensing.config import CameraConfig
from jaxbiped.study.config import StudyConfig
from tests.commands.test_cli import SCENE, here, refused

__all__ = ["here"]

ROBOT, CAMERA = "configs/robots/enuvo_walk.toml", "configs/cameras/narrow.toml"
COMMANDS = {
    "run": (SCENE,), "compare": (), "sweep": (), "tune": (), "stereo": ("l.png", "r.png", "--camera", "c.toml"),
    "classify": ("c.npz",),
}  # fmt: skip
WITH_CAMERA = ("run", "compare", "sweep", "tune")


@pytest.fixture
def parsed(here, monkeypatch):
    """The options that a command line comes to."""

    def parsed(command, *words):
        caught, module = [], importlib.import_module(f"jaxbiped.commands.{command}")
        monkeypatch.setattr(module, "main", lambda args: caught.append(args) or 0)
        assert cli.main([command, *COMMANDS[command], *words]) == 0
        return caught[0]

    (here / "tall.toml").write_text("radius = 0.09\nstanding = 0.41\n")
    (here / "wide.toml").write_text("width = 640\nheight = 480\nfield_of_view = 110.0\n")
    return parsed


def robot_of(args):
    return args.mission.robot if hasattr(args, "mission") else args.robot


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_with_a_robot_takes_its_file(parsed, command):
    for words in (["--robot", "tall.toml"], ["--robot=tall.toml"]):
        robot = robot_of(parsed(command, *words))
        assert robot == RobotConfig(radius=0.09, standing=0.41)
        robot = robot_of(parsed(command, *words, "--robot.standing", "0.42"))
        assert (robot.radius, robot.standing) == (0.09, 0.42)


@pytest.mark.parametrize("command", WITH_CAMERA)
def test_every_command_with_a_mission_takes_a_cameras_file(parsed, command):
    camera = parsed(command, "--camera", "wide.toml").mission.camera
    assert camera == CameraConfig(width=640, height=480, field_of_view=110.0)
    camera = parsed(command, "--camera", "wide.toml", "--camera.width", "800", "--camera.columns", "80").mission.camera
    assert camera == CameraConfig(width=800, height=480, field_of_view=110.0, columns=80)


def test_toml_and_python_have_the_same_rule(here, parsed):
    on_line = parsed("compare", "--robot", "tall.toml", "--robot.step", "0.02", "--camera", "wide.toml").mission
    for robot in ('robot = { file = "tall.toml", step = 0.02 }', '[mission.robot]\nfile = "tall.toml"\nstep = 0.02'):
        text = f'[mission]\ncamera = "wide.toml"\n{robot}\n'
        (here / "study.toml").write_text(text)
        assert parsed("compare", "study.toml").mission == on_line
    in_python = MissionConfig(robot={"file": "tall.toml", "step": 0.02}, camera="wide.toml")
    assert in_python == on_line and config_hash(in_python) == config_hash(on_line)
    (here / "study.toml").write_text('[mission]\nrobot = "configs/robots/enuvo_walk.toml"\n')
    mission = parsed("compare", "study.toml", "--robot", "tall.toml").mission
    assert mission.robot.radius == 0.09  # the file of the command line in place of the other


def test_a_file_counts_as_given_and_its_own_radius_stays(parsed):
    assert parsed("run", "--executor", "sampled").mission.robot.radius == 0.125
    assert parsed("run", "--executor", "sampled", "--robot", "tall.toml").mission.robot.radius == 0.09


def test_a_limit_decides_the_robots_tolerance_on_the_command_line_as_in_toml(parsed):
    for words in (["--limits.height-tolerance", "0.02"], ["--limits.height_tolerance=.02"]):
        assert parsed("run", *words).mission == MissionConfig(limits={"height_tolerance": 0.02})
    mission = parsed("run", "--limits.height-tolerance", "0.02", "--robot.height-tolerance", "0.01").mission
    assert (mission.limits.height_tolerance, mission.robot.height_tolerance) == (0.02, 0.01)


def test_a_file_is_no_part_of_the_config(parsed):
    args = parsed("compare")
    assert "robot_file" not in args.model_dump() and "camera_file" not in args.model_dump()
    kept = StudyConfig.model_validate(parsed("compare", "--robot", ROBOT).model_dump(include={"mission"}))
    assert config_hash(kept) == config_hash(StudyConfig()) and load(RobotConfig, ROBOT) == RobotConfig()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--robot", "nowhere.toml"], "--robot: nowhere.toml: no such file"),
        (["--robot", "bad.toml"], "--robot: bad.toml: radius: must be less than or equal to 0.15 (got 3)"),
        (["--robot", "odd.toml"], "--robot: odd.toml: wheels: unknown key (got 4)"),
        (["--robot", "chain.toml"], "--robot: chain.toml: file: unknown key"),
        (["--camera", "bad.toml"], "--camera: bad.toml: radius: unknown key (got 3)"),
        (["--robot"], "--robot: must be given a value"),
        (["--camera", "wide.toml", "--camera.columns", "60"], "--camera: columns must divide the width of 640, got 60"),
    ],
)
def test_what_is_wrong_with_a_file_is_said_in_a_line(here, parsed, capsys, words, said):
    (here / "bad.toml").write_text("radius = 3\n")
    (here / "odd.toml").write_text("wheels = 4\n")
    (here / "chain.toml").write_text('file = "odd.toml"\n')
    assert refused(capsys, "run", SCENE, *words).startswith(f"jaxbiped: {said}")


def test_reproduce_takes_both_for_the_missions_of_its_scenes(here, parsed, monkeypatch, capsys):
    seen = []

    def gather(args, arenas, config, console):
        seen.append(config)
        raise InputError("enough")

    monkeypatch.setattr(reproduce, "gather", gather)
    monkeypatch.setattr(reproduce, "refuse_existing", seen.append)
    for words in ([], ["--robot", "tall.toml", "--camera", "wide.toml", "--preset", "real"]):
        refused(capsys, "reproduce", "--executor", "kinematic", *words)
    folder, plain, other_folder, own = seen
    assert plain == MissionConfig(sensor="stereo")
    assert own == MissionConfig(sensor="stereo", robot="tall.toml", camera="wide.toml", preset="real")
    assert other_folder.name.startswith(folder.name) and other_folder != folder
    assert "robot: nowhere.toml: no such file" in refused(capsys, "reproduce", "--robot", "nowhere.toml")
    assert "preset: must be one of ideal" in refused(capsys, "reproduce", "--preset", "best")


def test_in_toml_the_file_is_named_too(here, parsed, capsys):
    (here / "study.toml").write_text('[mission]\nrobot = "nowhere.toml"\n')
    assert refused(capsys, "compare", "study.toml") == "jaxbiped: study.toml: mission.robot: nowhere.toml: no such file"
    (here / "study.toml").write_text('robot_file = "tall.toml"\n')
    assert "study.toml: robot_file: unknown key" in refused(capsys, "compare", "study.toml")
    with pytest.raises(ValueError, match="must be a TOML file"):
        MissionConfig(robot={"file": 3})
    with pytest.raises(InputError):
        load(RobotConfig, "nowhere.toml")
