"""Calibration files of four kinds, and what is said about those that cannot be."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from jaxbiped.errors import InputError
from jaxbiped.sensing.config import CameraConfig
from jaxbiped.stereo import ideal
from jaxbiped.stereo.calibration import PoseConfig
from jaxbiped.stereo.calibration_files import load_rig

CONFIGS = Path(__file__).parents[2] / "configs" / "cameras"
SHAPE = (741, 500)
GOOD = {"width": 741, "height": 500, "focal": 994.978, "cx": 311.193, "cy": 254.877, "baseline": 0.193001}
MIDDLEBURY = """cam0=[994.978 0 311.193; 0 994.978 254.877; 0 0 1]
cam1=[994.978 0 342.279; 0 994.978 254.877; 0 0 1]
doffs=31.086
baseline=193.001
width=741
height=500
ndisp=70
isint=0
vmin=7
vmax=60
"""


def written(tmp_path, text, name="camera.toml"):
    path = tmp_path / name
    path.write_text(text)
    return path


def toml(values):
    return "\n".join(f"{key} = {value}" for key, value in values.items())


def test_the_motorcycle_camera():
    rig = load_rig(CONFIGS / "motorcycle.toml", SHAPE)
    assert rig.maps is None and rig.num_disparities == 64 and rig.up is None
    assert rig.camera.focal == 994.978 and rig.camera.doffs == 31.086 and rig.camera.size == SHAPE


def test_a_middlebury_file_is_the_same(tmp_path):
    rig = load_rig(written(tmp_path, MIDDLEBURY, "calib.txt"), SHAPE)
    assert rig.camera == load_rig(CONFIGS / "motorcycle.toml", SHAPE).camera
    assert rig.num_disparities == 80  # the next multiple of 16


def test_the_robots_camera_file():
    rig = load_rig(CONFIGS / "paper.toml", (512, 384))
    assert rig.camera == ideal(CameraConfig()) and rig.pose.height == 0.365 and rig.num_disparities == 160
    np.testing.assert_allclose(rig.up, [0, -np.cos(np.radians(30)), -np.sin(np.radians(30))])


@pytest.mark.parametrize(("pitch", "roll", "up"), [(0, 0, (0, -1, 0)), (90, 0, (0, 0, -1)), (0, 90, (-1, 0, 0))])
def test_poses(pitch, roll, up):
    """A camera that looks down sees up behind it; one rolled to the right, to its left."""
    np.testing.assert_allclose(PoseConfig(pitch=pitch, roll=roll).up, up, atol=1e-12)


def opencv_file(path, translation):
    """As OpenCV's programs write it."""
    matrix = np.array([[700.0, 0, 370], [0, 702, 250], [0, 0, 1]])
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, value in (("M1", matrix), ("D1", np.zeros((1, 5))), ("M2", matrix + 0), ("D2", np.zeros((1, 5)))):
        storage.write(name, value)
    storage.write("R", np.array([0.0, 0.01, 0.0]))  # as a rotation vector
    storage.write("T", np.array(translation)[:, None])
    storage.release()
    return path


def test_an_opencv_file(tmp_path):
    path = opencv_file(tmp_path / "rig.yml", [-0.2, 0.001, 0.0])
    rig = load_rig(path, SHAPE)
    assert rig.camera.size == SHAPE and rig.camera.baseline == pytest.approx(0.2, rel=1e-3) and len(rig.maps) == 4
    text = path.read_text()
    sized = written(tmp_path, text + "image_width: 640\nimage_height: 480\n", "sized.yaml")
    assert load_rig(sized, SHAPE).camera.size == (640, 480)
    listed = written(tmp_path, text + "imageSize: [800, 600]\n", "listed.yaml")
    assert load_rig(listed, SHAPE).camera.size == (800, 600)
    missing = written(tmp_path, text.replace("M2", "N2"), "missing.yaml")
    with pytest.raises(InputError, match=r"missing.yaml: M2: is missing: an OpenCV calibration holds M1, D1"):
        load_rig(missing, SHAPE)
    millimetres = opencv_file(tmp_path / "mm.yaml", [-200.0, 1.0, 0.0])
    with pytest.raises(InputError, match=r"mm.yaml: translation must be 0.001 to 2 m long \(in metres\), got 200"):
        load_rig(millimetres, SHAPE)


FOREIGN_LENSES = [
    ("camera_model: fisheye", "camera_model"),
    ('model: "omnidirectional"', "model"),
    ("cameraType: catadioptric", "cameraType"),
    ("distortion_model: equidistant", "distortion_model"),
    ("fisheye_model: 1", "fisheye_model"),
    ("isFisheye: 1", "isFisheye"),
    ("xi1: 1.2", "xi1"),
    ("cam:\n   lensModel: ocam", "lensModel"),
]


@pytest.mark.parametrize(("line", "key"), FOREIGN_LENSES)
def test_other_lenses_in_an_opencv_file(tmp_path, line, key):
    """D of a fisheye has four numbers, too: what tells it is its name or its flag."""
    text = opencv_file(tmp_path / "rig.yml", [-0.2, 0.001, 0.0]).read_text()
    with pytest.raises(InputError, match=rf"fish.yml: {key}: (must be one of pinhole|is for an omnidirectional lens)"):
        load_rig(written(tmp_path, text + line + "\n", "fish.yml"), SHAPE)
    pinhole = "fisheye_model: 0\ncamera_model: pinhole\nmodel: D435\ncalibration_time: today\n"
    assert load_rig(written(tmp_path, text + pinhole, "pinhole.yml"), SHAPE).camera.size == SHAPE


def test_other_lenses_in_xml_and_in_a_middlebury_file(tmp_path):
    text = opencv_file(tmp_path / "rig.xml", [-0.2, 0.001, 0.0]).read_text()
    path = written(
        tmp_path, text.replace("</opencv_storage>", "<fisheye_model>1</fisheye_model></opencv_storage>"), "f.xml"
    )
    with pytest.raises(InputError, match=r"f.xml: fisheye_model: must be one of pinhole"):
        load_rig(path, SHAPE)
    with pytest.raises(InputError, match=r"calib.txt: camera_model: must be one of pinhole"):
        load_rig(written(tmp_path, MIDDLEBURY + "camera_model=equidistant\n", "calib.txt"), SHAPE)


@pytest.mark.parametrize("model", ["radtan", "equidistant"])
def test_kalibr_is_named(tmp_path, model):
    text = f"cam0:\n  camera_model: pinhole\n  distortion_model: {model}\n  intrinsics: [1.0, 2.0, 3.0, 4.0]\n"
    with pytest.raises(InputError, match=r"k.yaml: is a calibration of Kalibr, which is not supported"):
        load_rig(written(tmp_path, text, "k.yaml"), SHAPE)


def test_matrices_that_would_be_read_wrongly(tmp_path):
    """MATLAB's are transposed, and have other names for distortion: no distortion must not be read for these."""
    text = opencv_file(tmp_path / "rig.yml", [-0.2, 0.001, 0.0]).read_text()
    turned = text.replace(
        "data: [ 700., 0., 370., 0., 702., 250., 0., 0., 1. ]", "data: [ 700., 0., 0., 0., 702., 0., 370., 250., 1. ]"
    )
    assert turned != text
    with pytest.raises(
        InputError, match=r"t.yml: M1: must be \[\[fx, 0, cx\], \[0, fy, cy\], \[0, 0, 1\]\], without skew"
    ):
        load_rig(written(tmp_path, turned, "t.yml"), SHAPE)
    for name in ("RadialDistortion1", "kc_left", "dist1"):
        renamed = text.replace("D1:", f"{name}:")
        with pytest.raises(InputError, match=rf"d.yml: {name}: is not known; distortion must be under the names D1"):
            load_rig(written(tmp_path, renamed, "d.yml"), SHAPE)
    with pytest.raises(InputError, match=r"l.yml: M1: must be a matrix \(!!opencv-matrix\) of finite numbers"):
        load_rig(written(tmp_path, text.replace("M1:", "M1: [1, 2]\nN1:"), "l.yml"), SHAPE)


def test_a_middlebury_file_without_its_optional_lines(tmp_path):
    """Without doffs, the principal points tell it; without a size, the pictures do."""
    for dropped in ("doffs=31.086\n", "width=741\nheight=500\n", "ndisp=70\n"):
        rig = load_rig(written(tmp_path, MIDDLEBURY.replace(dropped, ""), "calib.txt"), SHAPE)
        assert rig.camera.doffs == pytest.approx(31.086) and rig.camera.size == SHAPE


def test_an_unrectified_pair_in_toml(tmp_path):
    text = """
width = 741
height = 500
rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
translation = [-0.2, 0.0, 0.0]
[left]
focal = [700.0, 700.0]
centre = [370.0, 250.0]
distortion = [-0.1, 0.01, 0.0, 0.0]
[right]
focal = [700.0, 700.0]
centre = [370.0, 250.0]
[pose]
pitch = 20.0
height = 0.4
"""
    rig = load_rig(written(tmp_path, text), SHAPE)
    assert rig.camera.baseline == pytest.approx(0.2) and rig.pose.height == 0.4


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"focal": 0}, "focal"),
        ({"focal": 1.5}, r"focal must be in pixels, 74.1 to 37050 for a width of 741, got 1.5"),
        ({"baseline": 193.001}, "baseline: .*less than or equal to 2"),
        ({"baseline": -0.1}, "baseline"),
        ({"cx": -5000.0}, "cx must be in pixels"),
        ({"doffs": 800.0}, "doffs must be less than the width of 741 px, got 800"),
        ({"width": 0}, "width"),
        ({"num_disparities": 50}, "multiple of 16"),
        ({"focal": "nan"}, "finite"),
        ({"focal": '"long"'}, "focal"),
        ({"lens": 3}, "lens: unknown key"),
    ],
)
def test_absurd_values_are_named(tmp_path, change, words):
    path = written(tmp_path, toml(GOOD | change))
    with pytest.raises(InputError, match=words) as caught:
        load_rig(path, SHAPE)
    assert str(caught.value).startswith(str(path)) and "\n" not in str(caught.value)


def test_missing_values_are_named(tmp_path):
    path = written(tmp_path, toml({key: value for key, value in GOOD.items() if key != "baseline"}))
    with pytest.raises(InputError, match=r"camera.toml: baseline: is required"):
        load_rig(path, SHAPE)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("camera.toml", "focal = ", "is not valid TOML"),
        ("camera.json", "{}", r"camera: must be one of .toml, .yaml, .yml, .xml, .txt \(got '.json'\)"),
        ("calib.txt", "hello", "cam0: is missing: a Middlebury calib.txt holds"),
        ("calib.txt", MIDDLEBURY.replace("193.001", "wide"), "must hold finite numbers"),
        ("calib.txt", MIDDLEBURY.replace("; 0 0 1]", "]"), r"cam0: must be a matrix \[3, 3\]"),
        ("calib.txt", MIDDLEBURY.replace("193.001", "193001"), "baseline"),
        ("rig.yaml", "%YAML:1.0\n---\nfoo: [", "is not an OpenCV calibration"),
        ("rig.yaml", "hello", "OpenCV calibration"),
        ("rig.xml", "", "OpenCV calibration"),
    ],
)
def test_damaged_files(tmp_path, name, text, words, capfd):
    with pytest.raises(InputError, match=words):
        load_rig(written(tmp_path, text, name), SHAPE)


def test_no_file(tmp_path):
    with pytest.raises(InputError, match=r"none.toml: camera: no such file"):
        load_rig(tmp_path / "none.toml", SHAPE)
    with pytest.raises(InputError, match="no such file"):
        load_rig(tmp_path, SHAPE)
