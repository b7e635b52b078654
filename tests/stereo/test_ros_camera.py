"""Calibrations of ROS: the pair that they describe, against OpenCV's own rectification of it, and bad files."""

import cv2
import numpy as np
import pytest
import yaml

from jaxbiped.errors import InputError
from jaxbiped.stereo.calibration_files import load_rig

SIZE = (640, 480)
K_LEFT = np.array([[520.0, 0, 322], [0, 521, 241], [0, 0, 1]])
K_RIGHT = np.array([[523.0, 0, 318], [0, 524, 238], [0, 0, 1]])
D = np.array([-0.2, 0.05, 0.001, -0.0005, 0.0])
ROTATION = cv2.Rodrigues(np.array([0.01, -0.02, 0.005]))[0]
TRANSLATION = np.array([-0.12, 0.001, 0.002])


def field(values):
    rows, columns = np.atleast_2d(values).shape
    return {"rows": rows, "cols": columns, "data": np.ravel(values).tolist()}


def cameras():
    """Both files, as camera_calibration would write them of this pair."""
    R_left, R_right, P_left, P_right, *_ = cv2.stereoRectify(
        K_LEFT, D, K_RIGHT, D, SIZE, ROTATION, TRANSLATION[:, None], flags=cv2.CALIB_ZERO_DISPARITY, alpha=0
    )
    return {
        name: {
            "image_width": SIZE[0],
            "image_height": SIZE[1],
            "camera_name": name,
            "camera_matrix": field(K),
            "distortion_model": "plumb_bob",
            "distortion_coefficients": field(D),
            "rectification_matrix": field(R),
            "projection_matrix": field(P),
        }
        for name, K, R, P in (("left", K_LEFT, R_left, P_left), ("right", K_RIGHT, R_right, P_right))
    }


def written(folder, files):
    for name, content in files.items():
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(content))
    return folder / "left.yaml"


@pytest.mark.parametrize("given", ["left.yaml", "right.yaml"])
def test_the_pair_is_that_of_both_files(tmp_path, given):
    files = cameras()
    written(tmp_path, files)
    rig = load_rig(tmp_path / given, (1, 1))
    P = np.reshape(files["left"]["projection_matrix"]["data"], (3, 4))
    assert rig.camera.size == SIZE and len(rig.maps) == 4
    assert rig.camera.focal == pytest.approx(P[0, 0], abs=1e-6)
    np.testing.assert_allclose(rig.camera.centre, P[:2, 2], atol=1e-6)
    assert rig.camera.baseline == pytest.approx(np.linalg.norm(TRANSLATION), abs=1e-9)
    np.testing.assert_allclose(
        rig.R_rectified_left, np.reshape(files["left"]["rectification_matrix"]["data"], (3, 3)), atol=1e-9
    )


def test_pictures_that_are_rectified_already(tmp_path):
    """No distortion, R = 1 and K = P: nothing is left to do."""
    files = cameras()
    for name, shift in (("left", 0.0), ("right", -62.4)):
        files[name]["distortion_coefficients"]["data"] = [0.0] * 5
        files[name]["rectification_matrix"] = field(np.eye(3))
        files[name]["camera_matrix"] = field(K_LEFT * [[1, 1, 1], [0, 520 / 521, 1], [0, 0, 1]])
        files[name]["projection_matrix"] = field([[520.0, 0, 322, shift], [0, 520, 241, 0], [0, 0, 1, 0]])
    rig = load_rig(written(tmp_path, files), (1, 1))
    assert rig.camera.baseline == pytest.approx(0.12) and rig.camera.focal == pytest.approx(520, rel=2e-3)
    image = cv2.GaussianBlur(np.random.default_rng(0).integers(0, 255, SIZE[::-1], np.uint8), (0, 0), 4)
    same = rig.rectify(image, image)[0]
    assert np.mean(np.abs(same.astype(int) - image)) < 0.2  # grey levels; a pixel aside, it is 0.75


def test_eight_coefficients(tmp_path):
    files = cameras()
    for camera in files.values():
        camera["distortion_model"] = "rational_polynomial"
        camera["distortion_coefficients"] = field([*D, 0.0, 0.0, 0.0])
    assert load_rig(written(tmp_path, files), (1, 1)).camera.baseline == pytest.approx(np.linalg.norm(TRANSLATION))


def spoilt(side, name, value):
    """The two files with a field changed, or left out where the value is None."""
    files = cameras()
    if value is None:
        del files[side][name]
    else:
        files[side][name] = value
    return files


@pytest.mark.parametrize(
    ("side", "name", "value", "words"),
    [
        ("left", "projection_matrix", None, "left.yaml: projection_matrix: is missing"),
        ("right", "camera_matrix", field(np.zeros((3, 3))), "right.yaml: camera_matrix: is all zeros"),
        ("right", "rectification_matrix", field([1.0, 0]), "rectification_matrix: must hold 3 x 3 numbers"),
        ("left", "camera_matrix", {"data": [1, "wide"]}, "camera_matrix: must hold `data`, a list of finite numbers"),
        ("left", "camera_matrix", field([np.nan] * 9), "finite numbers"),
        ("left", "distortion_model", "equidistant", "distortion_model: must be one of pinhole, plumb_bob, radtan"),
        ("left", "distortion_coefficients", field([0.1] * 6), "distortion must hold 0, 4, 5, 8, 12 or 14 numbers"),
        ("right", "image_width", 320, r"right.yaml: image_width, image_height: must be as in left.yaml, 640 x 480"),
        ("right", "image_width", "wide", "must be whole numbers"),
        ("right", "projection_matrix", field(np.eye(3, 4)), "must hold the distance of the cameras"),
        ("right", "projection_matrix", field(np.eye(3, 4) * 500 + np.eye(3, 4, 3) * 60), "to the right of the left"),
    ],
)
def test_bad_files_are_named(tmp_path, side, name, value, words):
    with pytest.raises(InputError, match=words) as caught:
        load_rig(written(tmp_path, spoilt(side, name, value)), (1, 1))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("key", ["camera_model", "distortion_model", "lens_model", "CameraModel", "projection"])
@pytest.mark.parametrize("model", ["fisheye", "equidistant", "Kannala-Brandt", "omni", "thin_prism_fisheye", "mei"])
def test_other_lenses_are_refused_whatever_they_are_named_by(tmp_path, key, model):
    """ROS's own calibrator writes `camera_model: fisheye`, and four coefficients as of a pinhole."""
    files = cameras()
    for camera in files.values():
        camera.pop("distortion_model")
        camera["distortion_coefficients"] = field([0.175653, -0.031772, 0.000362, -0.000719])
        camera[key] = model
    with pytest.raises(
        InputError, match=rf"left.yaml: {key}: must be one of pinhole, .* not supported \(got '{model}'"
    ):
        load_rig(written(tmp_path, files), (1, 1))
    files["left"][key] = "pinhole"
    with pytest.raises(InputError, match=rf"right.yaml: {key}: must be one of pinhole"):
        load_rig(written(tmp_path, files), (1, 1))


@pytest.mark.parametrize("model", ["pinhole", "Plumb Bob", "radtan", "brown_conrady", "PLUMB_BOB"])
def test_names_of_the_pinhole_are_taken(tmp_path, model):
    files = cameras()
    for camera in files.values():
        camera |= {
            "camera_model": model,
            "model": "Bumblebee 2",
            "camera_type": "Basler",
            "lens": "6 mm",
            "distortion_model": "plumb_bob",
        }
    assert load_rig(written(tmp_path, files), (1, 1)).camera.baseline == pytest.approx(np.linalg.norm(TRANSLATION))


@pytest.mark.parametrize("model", ["none", "", None])
def test_no_model_has_no_coefficients(tmp_path, model):
    files = cameras()
    for camera in files.values():
        camera["distortion_model"] = model
    with pytest.raises(
        InputError, match="distortion_model: must be named, since the coefficients of distortion are not 0"
    ):
        load_rig(written(tmp_path, files), (1, 1))
    for camera in files.values():
        camera["distortion_coefficients"] = field([0.0] * 5)
    assert load_rig(written(tmp_path, files), (1, 1)).camera.size == SIZE


@pytest.mark.parametrize("K", [K_LEFT.T, K_LEFT + np.diag([3.0, 0.0], 1), K_LEFT * 2])
def test_camera_matrices_of_another_form(tmp_path, K):
    with pytest.raises(InputError, match=r"camera_matrix: must be \[\[fx, 0, cx\], .* without skew and not transposed"):
        load_rig(written(tmp_path, spoilt("left", "camera_matrix", field(K))), (1, 1))


def test_one_file_alone(tmp_path):
    path = written(tmp_path, cameras())
    (tmp_path / "right.yaml").unlink()
    with pytest.raises(InputError, match=r"needs the calibration of the other camera beside it, right\.yaml"):
        load_rig(path, (1, 1))
    with pytest.raises(InputError, match="must have left or right in its name"):
        load_rig(path.rename(tmp_path / "camera.yaml"), (1, 1))
