"""Each reader against nasty files: read rightly, or refused in one line of ours; never another error, never chatter."""

import io

import cv2
import numpy as np
import pytest
import yaml
from PIL import Image
from pypcd4 import Encoding, PointCloud

from jaxbiped.arenas.scene import load_scene
from jaxbiped.core import class_grid
from jaxbiped.core.class_grid import ClassGrid
from jaxbiped.formats import cloud, moving_ai, ros_map
from jaxbiped.formats.cloud import save_ply
from jaxbiped.stereo import images
from jaxbiped.stereo.calibration_files import load_rig
from tests.nasty_files import read_or_refuse, same, spoilt

POINTS = np.random.default_rng(0).integers(-400, 400, (40, 3)).astype(np.float32) / 128
SCENE = b'name = "a"\nstart = [0.3, 0.7, 0.0]\ngoal = [1.4, 0.7]\n'
MAP = b"type octile\nheight 2\nwidth 7\nmap\n.GS@OTW\n.......\n"
SCEN = "version 1\n3\tÅ b\u2028.map\t7\t2\t1\t0\t6\t1\t5.41421356\n4\tÅ.map\t7\t2\t0\t1\t6\t1\t6.0\n".encode()
CAMERA = b"width = 640\nheight = 480\nfocal = 300.0\ncx = 320.0\ncy = 240.0\nbaseline = 0.1\n"
MIDDLEBURY = (
    b"cam0=[994.978 0 311.193; 0 994.978 254.877; 0 0 1]\ncam1=[994.978 0 342.279; 0 994.978 254.877; 0 0 1]\n"
    b"doffs=31.086\nbaseline=193.001\nwidth=741\nheight=500\nndisp=70\n"
)
ROS_MAP = (
    b"image: m.pgm\nresolution: 0.05\norigin: [-1.0, 2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
)
PGM = b"P5\n# written by hand\n4 3\n255\n" + bytes(range(0, 240, 20))
PLAIN_PGM = b"P2\n# written by hand\n4 3\n255\n0 20 40 60\n80 100 120 140\n160 180 200 220\n"


def ros_camera(shift):
    def field(*values):
        return {"rows": 3, "cols": len(values) // 3, "data": [float(value) for value in values]}

    camera = {
        "image_width": 640,
        "image_height": 480,
        "distortion_model": "plumb_bob",
        "camera_matrix": field(300, 0, 320, 0, 300, 240, 0, 0, 1),
        "distortion_coefficients": field(0, 0, 0, 0, 0),
        "rectification_matrix": field(1, 0, 0, 0, 1, 0, 0, 0, 1),
        "projection_matrix": field(300, 0, 320, shift, 0, 300, 240, 0, 0, 0, 1, 0),
    }
    return yaml.safe_dump(camera, sort_keys=False).encode()


def opencv(suffix):
    storage = cv2.FileStorage(f"rig.{suffix}", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    for name in ("M1", "M2"):
        storage.write(name, np.array([[300.0, 0, 320], [0, 300, 240], [0, 0, 1]]))
    for name in ("D1", "D2"):
        storage.write(name, np.array([[-0.1, 0.01, 0, 0, 0]]))
    storage.write("R", np.eye(3))
    storage.write("T", np.array([[-0.1], [0.0], [0.0]]))
    storage.write("image_width", 640)
    storage.write("image_height", 480)
    return storage.releaseAndGetString().encode()


def ascii_ply():
    rows = b"".join(b"%g %g %g\n" % tuple(point) for point in POINTS.tolist())
    head = b"ply\nformat ascii 1.0\ncomment by hand\nelement vertex 40\n"
    return head + b"property float x\nproperty float y\nproperty float z\nend_header\n" + rows


def binary_ply(folder):
    save_ply(folder / "made.ply", POINTS)
    return (folder / "made.ply").read_bytes()


def pcd(folder, encoding):
    PointCloud.from_xyz_points(POINTS).save(folder / "made.pcd", encoding=Encoding(encoding))
    return (folder / "made.pcd").read_bytes()


def archive(**arrays):
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


def array(points):
    stream = io.BytesIO()
    np.save(stream, points)
    return stream.getvalue()


def picture(kind, **how):
    stream = io.BytesIO()
    Image.fromarray(np.random.default_rng(1).integers(0, 255, (12, 16), np.uint8)).save(stream, kind, **how)
    return stream.getvalue()


def read_scenario(path):
    grid = ClassGrid(np.ones((2, 7), np.int8), np.zeros((2, 7), np.int8), np.zeros(2), 0.05)
    found = moving_ai.load_scenario(path, grid)
    return found.start_ij.tolist(), found.goal_ij.tolist(), found.optimal.tolist()


def read_camera(path):
    rig = load_rig(path, (640, 480))
    return rig.camera, rig.num_disparities


def read_picture(path):
    return images.read(path, "left").tolist()


def map_fields(grid):
    return grid.classes.tolist(), grid.origin_xy.tolist(), grid.pitch


# name of the file: (content, reader); of text, every reader takes what `same` does to it
TEXTS = {
    "scene.toml": (SCENE, lambda path: (load_scene(path)[0], load_scene(path)[1].goal_xy.tolist())),
    "camera.toml": (CAMERA, read_camera),
    "a.map": (MAP, lambda path: map_fields(moving_ai.load_map(path))),
    "a.scen": (SCEN, read_scenario),
    "map.yaml": (ROS_MAP, lambda path: map_fields(ros_map.load(path))),
    "calib.txt": (MIDDLEBURY, read_camera),
    "left.yaml": (ros_camera(0.0), read_camera),
    "rig.yaml": (opencv("yaml"), read_camera),
    "rig.xml": (opencv("xml"), read_camera),
    "a.ply": (ascii_ply(), lambda path: cloud.load(path).points.tolist()),
    "b.pcd": (None, lambda path: cloud.load(path).points.tolist()),
}
BINARIES = {
    "b.ply": binary_ply,
    "c.pcd": lambda folder: pcd(folder, "binary"),
    "d.pcd": lambda folder: pcd(folder, "binary_compressed"),
    "a.npz": lambda folder: archive(points=POINTS),
    "a.npy": lambda folder: array(POINTS),
    "grid.npz": lambda folder: archive(
        classes=np.ones((3, 4), np.int8), levels=np.zeros((3, 4), np.int8), origin_xy=np.zeros(2), pitch=0.05
    ),
    "m.pgm": lambda folder: PGM,
    "p.pgm": lambda folder: PLAIN_PGM,
    "a.png": lambda folder: picture("PNG"),
    "a.tiff": lambda folder: picture("TIFF"),
    "z.tiff": lambda folder: picture("TIFF", compression="tiff_lzw"),
    "a.jpg": lambda folder: picture("JPEG"),
}


def reader_of(name):
    if name == "grid.npz":
        return lambda path: map_fields(class_grid.load(path))
    if name.endswith(".pgm"):
        return lambda path: map_fields(ros_map.load(path))
    if name.endswith((".png", ".tiff", ".jpg")):
        return read_picture
    return lambda path: cloud.load(path).points.tolist()


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "m.pgm").write_bytes(PGM)
    (tmp_path / "right.yaml").write_bytes(ros_camera(-30.0))
    for name in ("m", "p"):
        (tmp_path / f"{name}.yaml").write_bytes(ROS_MAP.replace(b"m.pgm", f"{name}.pgm".encode()))
    return tmp_path


@pytest.mark.parametrize("name", TEXTS)
def test_what_editors_do_to_a_text_changes_nothing(folder, name, capfd, recwarn):
    content, read = TEXTS[name]
    content = content or pcd(folder, "ascii")
    (folder / name).write_bytes(content)
    expected = read(folder / name)
    for what, text in same(content):
        (folder / name).write_bytes(text)
        got = read_or_refuse(read, folder / name, what)
        assert repr(got) == repr(expected), what
    assert capfd.readouterr() == ("", "") and not [str(warning.message) for warning in recwarn]


@pytest.mark.parametrize("name", TEXTS)
def test_a_spoilt_text_is_read_or_refused_in_one_line(folder, name, capfd, recwarn):
    content, read = TEXTS[name]
    content = content or pcd(folder, "ascii")
    for what, text in spoilt(content, 1 if len(content) < 500 else 7):
        (folder / name).write_bytes(text)
        read_or_refuse(read, folder / name, what)
    assert capfd.readouterr() == ("", "") and not [str(warning.message) for warning in recwarn]


@pytest.mark.parametrize("name", BINARIES)
def test_a_spoilt_binary_is_read_or_refused_in_one_line(folder, name, capfd, recwarn):
    content = BINARIES[name](folder)
    path = folder / name
    path.write_bytes(content)
    expected = reader_of(name)(path)
    assert expected
    for what, spoiled in spoilt(content, max(1, len(content) // 150)):
        path.write_bytes(spoiled)
        read_or_refuse(reader_of(name), path, what)
    rng = np.random.default_rng(2)
    for k in range(100):
        wrong = bytearray(content)
        wrong[rng.integers(len(content))] = rng.integers(256)
        path.write_bytes(wrong)
        read_or_refuse(reader_of(name), path, f"wrong byte {k}")
    assert capfd.readouterr() == ("", "") and not [str(warning.message) for warning in recwarn]
