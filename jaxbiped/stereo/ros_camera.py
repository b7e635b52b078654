"""Calibrations of ROS: two YAML files of sensor_msgs/CameraInfo, left and right, as camera_calibration writes them.

Each has its own camera matrix K, distortion D, rectification R (camera to rectified frame) and projection P. Of a
rectified point, p_right = p_left - (b, 0, 0) with b = -P_right[0, 3] / P_right[0, 0], so that between the cameras
themselves p_right = R_right^T R_left p_left - R_right^T (b, 0, 0). (ROS REP 104; documentation of CameraInfo.)
Pictures are those that K and D belong to: `image_raw`, or others whose file says that nothing is left to rectify.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from jaxbiped.errors import InputError
from jaxbiped.files import read_text, read_yaml
from jaxbiped.stereo.lens_model import check_camera_matrix, check_lens_model

SIDES = {"left": "right", "right": "left"}
SHAPES = {"camera_matrix": (3, 3), "rectification_matrix": (3, 3), "projection_matrix": (3, 4)}
LEAST_SHIFT = 1e-9  # [px] of focal length times baseline: a single camera has 0


def is_ros(path: Path) -> bool:
    """Whether a YAML file is one of these, and not one of OpenCV's."""
    text = read_text(path, otherwise="latin-1")[:100_000]
    return "opencv-matrix" not in text and bool(re.search(r"^(camera|projection)_matrix\s*:", text, re.MULTILINE))


def read_ros(path: Path) -> dict:
    """The fields of `RawConfig`, from the file of one camera and the file of the other camera beside it.

    Raises:
      InputError: no other file, fields that are missing or of another shape, lenses incompatible with OpenCV's model,
        pictures of different size, or no distance between the cameras.
    """
    side = next((side for side in SIDES if side in path.name), None)
    if side is None:
        raise InputError("must have left or right in its name, by which the other camera's file is found", file=path)
    other = path.with_name(path.name.replace(side, SIDES[side], 1))
    if not other.is_file():
        raise InputError(f"needs the calibration of the other camera beside it, {other.name}", file=path)
    files = {side: path, SIDES[side]: other}
    left, right = (read_camera(files[name]) for name in ("left", "right"))
    if left["size"] != right["size"]:
        message = f"must be as in {files['left'].name}, {left['size'][0]} x {left['size'][1]}"
        raise InputError(message, file=files["right"], field="image_width, image_height", value=list(right["size"]))
    projection = right["projection_matrix"]
    shift = -projection[0, 3]
    if not abs(shift) > LEAST_SHIFT:
        message = "must hold the distance of the cameras, -focal length * baseline, in its fourth number"
        raise InputError(message, file=files["right"], field="projection_matrix", value=float(projection[0, 3]))
    R_left, R_right = left["rectification_matrix"], right["rectification_matrix"]
    translation = -R_right.T @ np.array([shift / projection[0, 0], 0.0, 0.0])
    data = {
        "width": left["size"][0],
        "height": left["size"][1],
        "rotation": (R_right.T @ R_left).tolist(),
        "translation": translation.tolist(),
    }
    for name, camera in (("left", left), ("right", right)):
        matrix = camera["camera_matrix"]
        data[name] = {
            "focal": (matrix[0, 0], matrix[1, 1]),
            "centre": (matrix[0, 2], matrix[1, 2]),
            "distortion": camera["distortion"],
        }
    return data


def read_camera(path: Path) -> dict:
    """Size, matrices and distortion of one file."""
    content = read_yaml(path)
    if not isinstance(content, dict):
        raise InputError("is not the calibration of a camera", file=path)
    check_lens_model(content, path)  # the calibrator writes distortion_model, camera_model or both
    found = {name: matrix(content, name, shape, path) for name, shape in SHAPES.items()}
    check_camera_matrix(found["camera_matrix"], path, "camera_matrix")
    size = tuple(content.get(name) for name in ("image_width", "image_height"))
    if not all(isinstance(pixels, int) for pixels in size):
        raise InputError("must be whole numbers", file=path, field="image_width, image_height", value=list(size))
    distortion = tuple(numbers(content, "distortion_coefficients", path))
    if str(content.get("distortion_model", "plumb_bob") or "none").lower() == "none":
        if any(distortion):
            message = "must be named, since the coefficients of distortion are not 0"
            raise InputError(message, file=path, field="distortion_model", value=content["distortion_model"])
        distortion = ()
    return found | {"size": size, "distortion": distortion}


def matrix(content: dict, name: str, shape: tuple[int, int], path: Path) -> Float64[np.ndarray, "m n"]:
    """One matrix of a file."""
    values = numbers(content, name, path)
    if len(values) != shape[0] * shape[1]:
        raise InputError(f"must hold {shape[0]} x {shape[1]} numbers", file=path, field=name, value=len(values))
    if not np.any(values[: shape[1]]):  # zeros mean an uncalibrated camera
        raise InputError("is all zeros: this camera is not calibrated", file=path, field=name)
    return np.array(values).reshape(shape)


def numbers(content: dict, name: str, path: Path) -> list[float]:
    """The `data` of a field."""
    field = content.get(name)
    values = field.get("data") if isinstance(field, dict) else None
    if not isinstance(values, list) or not all(isinstance(v, int | float) and abs(v) < 1e300 for v in values):
        message = "must hold `data`, a list of finite numbers" if name in content else "is missing"
        raise InputError(message, file=path, field=name)
    return [float(value) for value in values]
