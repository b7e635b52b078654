"""Rendered stereo from the command line: missions that see, cameras that cannot be, machines that cannot render."""

import json

import pytest
from PIL import Image

from jaxbiped import cli
from jaxbiped.config import load
from jaxbiped.fitting.ray_sensor_fit import choices
from jaxbiped.sensing.config import CameraConfig
from jaxbiped.sensing.presets import SensorConfig
from jaxbiped.stereo import renderer

SCENE = """
name = "short"
size = [1.2, 1.0]
start = [0.25, 0.5, 0.0]
goal = [0.4, 0.5]
floor_contrast = {contrast}
landmarks = [{{ kind = "circle", at = [0.9, 0.3] }}, {{ kind = "circle", at = [0.9, 0.7] }}]
"""


@pytest.fixture
def scene(tmp_path, monkeypatch):
    """A short way on an empty floor, in an empty working folder."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "short.toml"
    path.write_text(SCENE.format(contrast=1.0))
    return path


def refused(capsys, *argv: str) -> str:
    """The one line that a command line is refused with."""
    assert cli.main(argv) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("jaxbiped: ")
    return lines[0]


@pytest.mark.slow
def test_short_mission(scene, capsys):
    """It reaches its goal, says where it is to a few millimetres, and its film shows what it sees."""
    assert cli.main(["run", str(scene), "--sensor", "stereo", "--out", "seen"]) == 0
    assert "sensor stereo" in capsys.readouterr().out
    told = json.loads((scene.parent / "seen" / "mission.json").read_text())
    assert told["code"] == "reached" and told["config"]["sensor"] == "stereo"
    with Image.open(scene.parent / "seen" / "mission.gif") as film:
        assert film.width > 1.2 * film.height


@pytest.mark.slow
def test_floor_without_texture_ends_by_name(scene, capsys):
    """Nothing is measured, so that the robot looks around, and gives up or walks on by what it was told: no crash."""
    scene.write_text(SCENE.format(contrast=0.0))
    assert cli.main(["run", str(scene), "--sensor", "stereo", "--limits.max-decisions", "6", "--out", "plain"]) in (
        0,
        1,
    )
    told = json.loads((scene.parent / "plain" / "mission.json").read_text())
    assert told["code"] in ("reached", "no_path", "stuck", "out_of_steps")


@pytest.mark.parametrize(
    "argv",
    [("run", "short.toml", "--sensor", "stereo"), ("compare", "--arenas", "2", "--sensor", "stereo"), ("fit-sensor",)],
)
def test_machine_that_cannot_render(scene, capsys, monkeypatch, argv):
    def broken(name, width, height):
        raise ImportError("no such library")

    monkeypatch.setattr(renderer, "opened", broken)
    monkeypatch.setenv("MUJOCO_GL", "egl")
    line = refused(capsys, *argv)
    assert "libegl1" in line and "no such library" in line
    assert sorted(path.name for path in scene.parent.iterdir()) == ["short.toml"]


@pytest.mark.parametrize(
    ("camera", "said"),
    [
        ("lens = 3", ["cam.toml", "lens", "unknown key"]),
        ("field_of_view = 200", ["field_of_view", "160"]),
        ("baseline = -0.1", ["baseline", "greater than 0"]),
        ("width = 'wide'", ["width", "wide"]),
        ("image_noise = nan", ["image_noise", "finite"]),
        ("columns = 60", ["columns", "divide"]),
        ("width = [", ["cam.toml", "TOML"]),
        (None, ["cam.toml", "no such file"]),
    ],
)
def test_cameras_that_cannot_be(scene, capsys, camera, said):
    if camera is not None:
        (scene.parent / "cam.toml").write_text(camera)
    line = refused(capsys, "fit-sensor", "--camera", "cam.toml")
    assert all(part in line for part in said), line


def test_existing_file_is_kept(scene, capsys):
    (scene.parent / "mine.toml").write_text("mine")
    assert "does not exist" in refused(capsys, "fit-sensor", "--out", "mine.toml")
    assert (scene.parent / "mine.toml").read_text() == "mine"


@pytest.mark.slow
def test_fit_sensor_writes_a_preset(scene, capsys):
    argv = ["fit-sensor", "--arenas", "2", "--views", "3", "--missions", "1", "--out", "mine.toml"]
    assert cli.main(argv) == 0
    said = capsys.readouterr().out
    for start in ("camera", "matcher", "landmarks", "rays", "maps", "missions", "written"):
        assert f"\n{start}" in f"\n{said}"
    fitted = load(SensorConfig, scene.parent / "mine.toml")
    assert abs(fitted.stereo.bias) < 0.1 and 0.1 < fitted.stereo.sd < 0.2 and fitted.stereo.drop_plain < 0.15
    assert fitted.rays in choices(CameraConfig())
    assert f"{fitted.rays.columns} x {fitted.rays.rows}: " in said
    text = (scene.parent / "mine.toml").read_text()
    assert text.startswith("# Written by `jaxbiped fit-sensor --arenas 2 --views 3 --seed 1`")
    for line in text.split("[stereo]")[1].splitlines():
        assert not line or line.startswith("[") or "# " in line  # every number says what it means
