"""Cameras and sensors from TOML: files that say what the constants do, and one clear line about bad ones."""

from pathlib import Path

import pytest

from jaxbiped import config
from jaxbiped.errors import InputError
from jaxbiped.mission.params import MissionConfig
from jaxbiped.sensing import PRESETS, CameraConfig, NoiseConfig, SensorConfig, sensor_preset

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.mark.parametrize("name", PRESETS)
def test_sensor_files_equal_the_constants(name):
    path = CONFIGS / "sensors" / f"{name}.toml"
    assert path.read_text().startswith("#")
    assert config.load(SensorConfig, path) == PRESETS[name] == sensor_preset(str(path))
    written = config.load_toml(path)
    for part in ("stereo", "landmarks"):  # every value is said, none left to defaults
        assert set(written[part]) == set(getattr(PRESETS[name], part).model_dump(exclude_none=True))


def test_sensor_folder_holds_the_presets_and_nothing_else():
    """But for the one that `jaxbiped fit-sensor` wrote."""
    assert {path.stem for path in (CONFIGS / "sensors").glob("*.toml")} == set(PRESETS) | {"stereo"}


def test_fitted_sensor_says_everything():
    path = CONFIGS / "sensors" / "stereo.toml"
    fitted, written = config.load(SensorConfig, path), config.load_toml(path)
    assert path.read_text().startswith("# Written by `jaxbiped fit-sensor")
    for part in ("stereo", "landmarks"):
        assert set(written[part]) == set(getattr(fitted, part).model_dump(exclude_none=True))
    assert abs(fitted.stereo.bias) < 0.1 and 0.1 < fitted.stereo.sd < 0.2


def test_sensor_file_says_how_many_rays(tmp_path):
    """In place of the camera's, unless these are given; the named presets leave the camera alone."""
    path = tmp_path / "many.toml"
    path.write_text("[rays]\ncolumns = 128\nrows = 96\n")
    found = [MissionConfig(preset=str(path), **more).camera for more in ({}, {"camera": {"rows": 64, "pitch": 20.0}})]
    assert [(camera.columns, camera.rows, camera.pitch) for camera in found] == [(128, 96, 30), (128, 64, 20)]
    assert all(MissionConfig(preset=name).camera == CameraConfig() for name in PRESETS)
    path.write_text("[rays]\ncolumns = 60\nrows = 48\n")
    with pytest.raises(ValueError, match="columns must divide the width of 512"):
        MissionConfig(preset=str(path))


def test_camera_files():
    assert config.load(CameraConfig, CONFIGS / "cameras" / "paper.toml") == CameraConfig()
    narrow = config.load(CameraConfig, CONFIGS / "cameras" / "narrow.toml")
    assert narrow == CameraConfig(field_of_view=66)


def test_the_paper_camera():
    """97 degrees across 512 px; nearest surface 0.17 m."""
    camera = CameraConfig().traced()
    assert abs(float(camera.focal) - 226.49) < 0.01
    assert abs(float(camera.focal * camera.baseline / camera.max_disparity) - 0.171) < 0.001
    assert CameraConfig().image.pixels_per_ray == 64


@pytest.mark.parametrize(
    ("model", "data", "words"),
    [
        (CameraConfig, {"columns": 60}, "columns must divide the width of 512"),
        (CameraConfig, {"rows": 0}, "rows"),
        (CameraConfig, {"field_of_view": 180}, "field_of_view"),
        (CameraConfig, {"baseline": float("nan")}, "baseline"),
        (CameraConfig, {"squat_drop": 0.4}, "camera_height of 0.365"),
        (CameraConfig, {"num_disparities": 100}, "multiple of 16"),
        (CameraConfig, {"lens": 1}, "unknown key"),
        (NoiseConfig, {"sd": -0.1}, "sd"),
        (NoiseConfig, {"drop_edge": 1.1}, "drop_edge"),
        (NoiseConfig, {"correlation": 0.6}, "correlation"),
        (NoiseConfig, {"max_range": "far"}, "max_range"),
        (NoiseConfig, {"stretch_kept": 0.5}, "stretch_lost must be above stretch_kept"),
        (NoiseConfig, {"stretch_kept": 0.5, "stretch_lost": 0.5}, "or both omitted"),
        (NoiseConfig, {"stretch_kept": -1, "stretch_lost": 1}, "stretch_kept"),
        (SensorConfig, {"landmarks": {"nearest": -1}}, "landmarks.nearest"),
        (SensorConfig, {"rays": {"columns": 2, "rows": 48}}, "rays.columns"),
        (SensorConfig, {"rays": {"columns": 64}}, "rays.rows"),
    ],
)
def test_bad_values_are_named(model, data, words):
    with pytest.raises(InputError, match=words):
        config.parse(model, data, file="my.toml")


def test_unknown_preset_lists_the_known():
    with pytest.raises(InputError, match=r"ideal, rendered, real.*'best'"):
        sensor_preset("best")
    with pytest.raises(InputError, match="no such file"):
        sensor_preset("nowhere.toml")
