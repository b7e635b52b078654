"""Calibration files: our TOML, the robot's camera file, YAML or XML of OpenCV, YAML of ROS, Middlebury's calib.txt."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np

from jaxbiped.config import load_toml, parse
from jaxbiped.errors import InputError
from jaxbiped.files import reason
from jaxbiped.sensing.camera import CameraConfig
from jaxbiped.sensing.stereo.calibration import PoseConfig, RawConfig, RectifiedConfig, ideal
from jaxbiped.sensing.stereo.rectify import Rig, make_rig
from jaxbiped.sensing.stereo.ros_camera import is_ros, read_ros

OPENCV = (".yaml", ".yml", ".xml")
SUFFIXES = (".toml", *OPENCV, ".txt")
# What OpenCV's samples, and programs made after them, call the same things.
NAMES = {
    "left": ("M1", "K1", "cameraMatrix1", "camera_matrix_left", "left_camera_matrix", "K_left"),
    "left_distortion": ("D1", "distCoeffs1", "dist_coeffs_left", "left_distortion", "D_left"),
    "right": ("M2", "K2", "cameraMatrix2", "camera_matrix_right", "right_camera_matrix", "K_right"),
    "right_distortion": ("D2", "distCoeffs2", "dist_coeffs_right", "right_distortion", "D_right"),
    "rotation": ("R",),
    "translation": ("T",),
}
SIZES = ("size", "imageSize", "image_size"), ("width", "image_width"), ("height", "image_height")


def load_rig(path: str | Path, shape: tuple[int, int]) -> Rig:
    """Read the calibration of a stereo camera.

    Args:
      path: .toml (`RectifiedConfig`, `RawConfig`, or the robot's own `CameraConfig`), .yaml, .yml or .xml of OpenCV's
        FileStorage, .yaml or .yml of ROS (one camera's, beside the other's), or a Middlebury calib.txt.
      shape: [px] width and height of the pictures, where the file does not say.

    Raises:
      InputError: no such file, another suffix, keys that are missing or unknown, values that no camera has.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if not path.is_file():
        raise InputError("no such file", file=path, field="camera")
    if suffix not in SUFFIXES:
        raise InputError(f"must be one of {', '.join(SUFFIXES)}", file=path, field="camera", value=path.suffix)
    if suffix == ".toml":
        return read_toml(path)
    if suffix not in OPENCV:
        data = read_middlebury(path, shape)
    else:
        data = read_ros(path) if suffix != ".xml" and is_ros(path) else read_opencv(path, shape)
    return make_rig(parse(RawConfig if "left" in data else RectifiedConfig, data, file=path))


def read_toml(path: Path) -> Rig:
    """Our own files, told apart by their keys."""
    data = load_toml(path)
    if "field_of_view" in data or not {"focal", "left", "right", "cx"} & set(data):
        robot = parse(CameraConfig, data, file=path)
        pose = PoseConfig(pitch=robot.pitch, height=robot.camera_height)
        return Rig(ideal(robot), None, np.eye(3), robot.num_disparities, pose)
    try:
        return make_rig(parse(RawConfig if "left" in data else RectifiedConfig, data, file=path))
    except InputError as error:
        if error.file is None:
            raise InputError(str(error), file=path) from None
        raise


def read_opencv(path: Path, shape: tuple[int, int]) -> dict:
    """OpenCV's FileStorage: matrices, distortions, R and T under any of their usual names."""
    try:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    except (cv2.error, SystemError) as error:
        what = str(error).strip().splitlines()[-1][:100]
        raise InputError(f"is no OpenCV calibration: {what}", file=path) from None
    found = {}
    for key, names in NAMES.items():
        nodes = (storage.getNode(name) for name in names)
        found[key] = next((node.mat() for node in nodes if not node.empty()), None)
        if found[key] is None and "distortion" not in key:
            message = f"is missing: an OpenCV calibration holds {', '.join(v[0] for v in NAMES.values())}"
            raise InputError(message, file=path, field=names[0])
    width, height = opencv_size(storage, shape)
    rotation = found["rotation"]
    if rotation.size == 3:
        rotation = cv2.Rodrigues(rotation)[0]
    if rotation.shape != (3, 3) or found["translation"].size != 3:
        raise InputError("must be R [3, 3] and T [3]", file=path, field="R", value=list(rotation.shape))
    data = {
        "width": width,
        "height": height,
        "rotation": rotation.tolist(),
        "translation": found["translation"].ravel().tolist(),
    }
    for side in ("left", "right"):
        matrix, distortion = found[side], found[f"{side}_distortion"]
        if matrix.shape != (3, 3):
            raise InputError("must be a matrix [3, 3]", file=path, field=NAMES[side][0], value=list(matrix.shape))
        data[side] = {
            "focal": (matrix[0, 0], matrix[1, 1]),
            "centre": (matrix[0, 2], matrix[1, 2]),
            "distortion": () if distortion is None else tuple(distortion.ravel()),
        }
    return data


def opencv_size(storage: cv2.FileStorage, shape: tuple[int, int]) -> tuple[int, int]:
    """Width and height as the file says, else those of the pictures."""
    pair, *sides = ([storage.getNode(name) for name in names] for names in SIZES)
    for node in pair:
        if node.isSeq() and node.size() == 2:
            return int(node.at(0).real()), int(node.at(1).real())
    said = [next((int(node.real()) for node in nodes if not node.empty()), None) for nodes in sides]
    return tuple(ours if theirs is None else theirs for ours, theirs in zip(shape, said, strict=True))


def read_middlebury(path: Path, shape: tuple[int, int]) -> dict:
    """A calib.txt of the Middlebury benchmarks (2014, 2021): cam0, cam1, doffs [px], baseline [mm], width, height."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        what = reason(error) if isinstance(error, OSError) else "is no text"
        raise InputError(f"cannot be read: {what}", file=path) from None
    fields = dict(re.findall(r"^\s*(\w+)\s*=\s*(.*?)\s*$", text, re.MULTILINE))
    for name in ("cam0", "baseline"):
        if name not in fields:
            raise InputError("is missing: a Middlebury calib.txt holds cam0, doffs, baseline", file=path, field=name)
    try:
        cam0 = [float(number) for number in re.split(r"[\s;,\[\]]+", fields["cam0"]) if number]
        baseline, doffs = float(fields["baseline"]) / 1000, float(fields.get("doffs", 0))
        width, height = (int(fields.get(name, side)) for name, side in zip(("width", "height"), shape, strict=True))
        searched = int(float(fields["ndisp"])) if "ndisp" in fields else None
    except ValueError as error:
        raise InputError(f"must hold numbers: {error}", file=path) from None
    if len(cam0) != 9:
        raise InputError("must be a matrix [3, 3]", file=path, field="cam0", value=fields["cam0"])
    data = {"width": width, "height": height, "focal": cam0[0], "cx": cam0[2], "cy": cam0[5]}
    data |= {"baseline": baseline, "doffs": doffs}
    if searched is not None:
        data["num_disparities"] = min(max(-(-searched // 16) * 16, 16), 2048)
    return data
