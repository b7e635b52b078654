"""Calibration files: our TOML, the robot's camera file, YAML or XML of OpenCV, YAML of ROS, Middlebury's calib.txt."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from jaxbiped.config import load_toml, parse
from jaxbiped.errors import InputError
from jaxbiped.files import read_text
from jaxbiped.sensing.config import CameraConfig
from jaxbiped.stereo.calibration import PoseConfig, RawConfig, RectifiedConfig, ideal
from jaxbiped.stereo.lens_model import check_camera_matrix, check_lens_model
from jaxbiped.stereo.rectify import Rig, make_rig
from jaxbiped.stereo.ros_camera import is_ros, read_ros

OPENCV = (".yaml", ".yml", ".xml")
SUFFIXES = (".toml", *OPENCV, ".txt")
# Names of the same values in OpenCV's samples, and in programs derived from them.
NAMES = {
    "left": ("M1", "K1", "cameraMatrix1", "camera_matrix_left", "left_camera_matrix", "K_left"),
    "left_distortion": ("D1", "distCoeffs1", "dist_coeffs_left", "left_distortion", "D_left"),
    "right": ("M2", "K2", "cameraMatrix2", "camera_matrix_right", "right_camera_matrix", "K_right"),
    "right_distortion": ("D2", "distCoeffs2", "dist_coeffs_right", "right_distortion", "D_right"),
    "rotation": ("R",),
    "translation": ("T",),
}
SIZES = ("size", "imageSize", "image_size"), ("width", "image_width"), ("height", "image_height")
UNREAD = re.compile("dist|^(kc|kd|d)_?([012lr]|left|right)$", re.IGNORECASE)  # keys that look like distortion
LONGEST = 10_000  # longest list that is read
SIDES = ("width", "height")


def load_rig(path: str | Path, shape: tuple[int, int]) -> Rig:
    """Read the calibration of a stereo camera.

    Args:
      path: .toml (`RectifiedConfig`, `RawConfig`, or the robot's own `CameraConfig`), .yaml, .yml or .xml of OpenCV's
        FileStorage, .yaml or .yml of ROS (one camera's, beside the other's), or a Middlebury calib.txt.
      shape: [px] width and height of the pictures, for files without a size.

    Raises:
      InputError: no such file, an unknown suffix, keys that are missing or unknown, implausible values.
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
    return rig_of(data, path)


def rig_of(data: dict, path: Path) -> Rig:
    """The rig in a file's data; raise `InputError` that names the file."""
    try:
        return make_rig(parse(RawConfig if "left" in data else RectifiedConfig, data, file=path))
    except InputError as error:
        if error.file is None:
            raise InputError(str(error), file=path) from None
        raise


def read_toml(path: Path) -> Rig:
    """Read our own files, distinguished by their keys."""
    data = load_toml(path)
    if "field_of_view" in data or not {"focal", "left", "right", "cx"} & set(data):
        robot = parse(CameraConfig, data, file=path)
        pose = PoseConfig(pitch=robot.pitch, height=robot.camera_height)
        return Rig(ideal(robot), None, np.eye(3), robot.num_disparities, pose)
    return rig_of(data, path)


def read_opencv(path: Path, shape: tuple[int, int]) -> dict:
    """OpenCV's FileStorage: matrices, distortions, R and T under any of their usual names."""
    text = read_text(path, otherwise="latin-1")
    if re.search(r"^cam0\s*:", text, re.MULTILINE) and re.search(r"^\s+intrinsics\s*:", text, re.MULTILINE):
        message = "is a calibration of Kalibr, which is not supported; write it as OpenCV's, ROS's or in TOML"
        raise InputError(message, file=path)
    try:
        storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        fields = plain(storage.root())
    except (cv2.error, SystemError):
        fields = None
    if not isinstance(fields, dict):
        raise InputError("is not an OpenCV calibration, or is damaged", file=path)
    check_lens_model(fields, path)
    found = {key: next((fields[name] for name in names if name in fields), None) for key, names in NAMES.items()}
    for key, value in found.items():
        if value is None and "distortion" not in key:
            message = f"is missing: an OpenCV calibration holds {', '.join(v[0] for v in NAMES.values())}"
            raise InputError(message, file=path, field=NAMES[key][0])
        if value is not None and not (isinstance(value, np.ndarray) and np.isfinite(value).all()):
            raise InputError("must be a matrix (!!opencv-matrix) of finite numbers", file=path, field=NAMES[key][0])
    unread = [name for name in fields if UNREAD.search(name) and name not in sum(NAMES.values(), ())]
    if unread and (found["left_distortion"] is None or found["right_distortion"] is None):
        message = "is not known; distortion must be under the names D1 and D2 (or distCoeffs1, distCoeffs2, ...)"
        raise InputError(message, file=path, field=unread[0])
    width, height = opencv_size(fields, shape, path)
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
        check_camera_matrix(matrix, path, NAMES[side][0])
        data[side] = {
            "focal": (matrix[0, 0], matrix[1, 1]),
            "centre": (matrix[0, 2], matrix[1, 2]),
            "distortion": () if distortion is None else tuple(distortion.ravel()),
        }
    return data


def plain(node: cv2.FileNode) -> Any:
    """A node of a FileStorage as Python and NumPy values: mappings, lists, numbers, texts, matrices (float64)."""
    if node.isMap():
        try:
            matrix = node.mat()
        except (cv2.error, SystemError):
            matrix = None
        if matrix is not None:
            return np.asarray(matrix, np.float64)
        return {key: plain(node.getNode(key)) for key in list(node.keys())}
    if node.isSeq():
        return [plain(node.at(k)) for k in range(min(node.size(), LONGEST))]
    if node.isString():
        return node.string()
    return int(node.real()) if node.isInt() else node.real() if node.isReal() else None


def opencv_size(fields: dict[str, Any], shape: tuple[int, int], path: Path) -> tuple[int, int]:
    """Width and height from the file, else those of the pictures."""
    pair, *sides = ([fields[name] for name in names if name in fields] for names in SIZES)
    for values in pair:
        if isinstance(values, list | np.ndarray) and np.size(values) == 2:
            said = tuple(np.ravel(values).tolist())
            break
    else:
        said = tuple(values[0] if values else ours for ours, values in zip(shape, sides, strict=True))
    if not all(isinstance(side, int | float) and side == side // 1 for side in said):
        raise InputError("must be whole numbers", file=path, field="size", value=list(said))
    return tuple(int(side) for side in said)


def read_middlebury(path: Path, shape: tuple[int, int]) -> dict:
    """A calib.txt of the Middlebury benchmarks (2014, 2021): cam0, cam1, doffs [px], baseline [mm], width, height."""
    fields = dict(re.findall(r"^[ \t]*(\w+)[ \t]*=[ \t]*(.*?)[ \t]*$", read_text(path), re.MULTILINE))
    check_lens_model(fields, path)
    for name in ("cam0", "baseline"):
        if name not in fields:
            raise InputError("is missing: a Middlebury calib.txt holds cam0, doffs, baseline", file=path, field=name)
    cameras = [number_list(fields[name], path, name) for name in ("cam0", "cam1") if name in fields]
    for name, numbers in zip(("cam0", "cam1"), cameras, strict=False):
        if len(numbers) != 9:
            raise InputError("must be a matrix [3, 3]", file=path, field=name, value=fields[name])
        check_camera_matrix(np.reshape(numbers, (3, 3)), path, name)
    baseline, searched = (one_number(fields, name, path) for name in ("baseline", "ndisp"))
    width, height = (one_number(fields, name, path, side) for name, side in zip(SIDES, shape, strict=True))
    doffs = one_number(fields, "doffs", path, cameras[-1][2] - cameras[0][2])
    data = {"width": width, "height": height, "focal": cameras[0][0], "cx": cameras[0][2], "cy": cameras[0][5]}
    data |= {"baseline": baseline / 1000, "doffs": doffs}
    if searched is not None:
        data["num_disparities"] = int(min(max(-(-searched // 16) * 16, 16), 2048))
    return data


def one_number(fields: dict[str, str], name: str, path: Path, default: float | int | None = None) -> float | int | None:
    """The number in a field, or its default."""
    if name not in fields:
        return default
    numbers = number_list(fields[name], path, name)
    if len(numbers) != 1:
        raise InputError("must be one number", file=path, field=name, value=fields[name])
    return numbers[0]


def number_list(text: str, path: Path, name: str) -> list[float]:
    """The finite numbers of a field, separated by spaces, brackets, commas and semicolons."""
    try:
        numbers = [float(word) for word in re.split(r"[\s;,\[\]]+", text) if word]
    except ValueError:
        numbers = [np.nan]
    if not np.isfinite(numbers).all():
        raise InputError("must hold finite numbers", file=path, field=name, value=text)
    return numbers
