"""Rectification: two distorted, turned cameras before a plane that is known."""

import cv2
import numpy as np
import pytest

from jaxbiped.config import parse
from jaxbiped.errors import InputError
from jaxbiped.stereo import MatchParams, match, to_points
from jaxbiped.stereo.calibration import RawConfig
from jaxbiped.stereo.rectify import make_rig
from tests.stereo.pairs import texture

SIZE = (320, 240)
RIGHT_FROM_LEFT = cv2.Rodrigues(np.radians([1.0, -2.0, 1.5]))[0]
LENSES = {
    "left": {"focal": (300.0, 302.0), "centre": (158.0, 121.0), "distortion": (-0.12, 0.05, 0.001, -0.001, 0.0)},
    "right": {"focal": (297.0, 298.0), "centre": (162.0, 118.0), "distortion": (-0.10, 0.03, 0.0, 0.002, 0.0)},
}
RAW = {
    "width": SIZE[0],
    "height": SIZE[1],
    **LENSES,
    "rotation": tuple(map(tuple, RIGHT_FROM_LEFT.tolist())),
    "translation": tuple((-RIGHT_FROM_LEFT @ [0.12, 0.004, -0.003]).tolist()),
}
NORMAL, OFFSET = np.array([0.1, -0.5, -1.0]) / np.linalg.norm([0.1, -0.5, -1.0]), -0.9  # n . p = offset [m], left frame


def picture(lens, R, T, painting, seed):
    """What a camera sees of the plane, which is painted along x and y of the left frame; p_camera = R p_left + T."""
    matrix = np.array([[lens["focal"][0], 0, lens["centre"][0]], [0, lens["focal"][1], lens["centre"][1]], [0, 0, 1]])
    u, v = np.meshgrid(np.arange(SIZE[0], dtype=np.float64), np.arange(SIZE[1], dtype=np.float64))
    pixels = np.stack([u, v], -1).reshape(-1, 1, 2)
    rays = cv2.undistortPoints(pixels, matrix, np.array(lens["distortion"]))[:, 0]
    rays = np.column_stack([rays, np.ones(len(rays))]) @ R  # in the left frame
    centre = -R.T @ T
    points = centre + rays * ((OFFSET - NORMAL @ centre) / (rays @ NORMAL))[:, None]
    at = (points[:, :2] * 300 + painting.shape[0] / 2).astype(np.float32).reshape(*SIZE[::-1], 2)
    image = cv2.remap(painting, at[..., 0], at[..., 1], cv2.INTER_CUBIC)
    noise = np.random.default_rng(seed).normal(size=image.shape)
    return np.clip(np.round(image + 1.5 * noise), 0, 255).astype(np.uint8)


@pytest.fixture(scope="module")
def pair():
    painting = 120 + 30 * texture((900, 900), 3)
    left = picture(LENSES["left"], np.eye(3), np.zeros(3), painting, 1)
    right = picture(LENSES["right"], RIGHT_FROM_LEFT, np.array(RAW["translation"]), painting, 2)
    return left, right


def test_a_plane_before_distorted_cameras(pair):
    rig = make_rig(parse(RawConfig, RAW))
    left, right = rig.rectify(*pair)
    found = match(left, right, MatchParams(num_disparities=96))
    assert found.valid.mean() > 0.75  # its left margin is in one picture only
    x, y, z, weight = to_points(found, rig.camera)
    points = np.stack([x, y, z], axis=1)[weight > 0] @ rig.R_rectified_left  # in the frame of the left camera
    distance = points @ NORMAL - OFFSET
    # 0.15 px of disparity at 0.9 m are 3.7 mm; were it not rectified, next to nothing would match.
    assert abs(np.median(distance)) < 0.002 and np.percentile(np.abs(distance), 90) < 0.012
    assert rig.camera.baseline == pytest.approx(np.linalg.norm([0.12, 0.004, -0.003]), rel=1e-6)


def test_the_pair_as_it_is_does_not_match(pair):
    assert match(*pair, MatchParams(num_disparities=96)).valid.mean() < 0.35


def test_rows_agree_after_rectification():
    """Random points, projected by both cameras and rectified, lie in the same row, and their disparity is f b / z."""
    rig = make_rig(parse(RawConfig, RAW))
    points = np.random.default_rng(0).uniform((-0.4, -0.3, 0.8), (0.4, 0.3, 2.0), (200, 3))
    rectified = points @ rig.R_rectified_left.T
    columns, rows = [], []
    config = parse(RawConfig, RAW)
    sides = ((config.left, np.eye(3), np.zeros(3)), (config.right, RIGHT_FROM_LEFT, np.array(RAW["translation"])))
    P = np.array([[rig.camera.focal, 0, rig.camera.centre[0]], [0, rig.camera.focal, rig.camera.centre[1]], [0, 0, 1]])
    for lens, R, T in sides:
        pixels, _ = cv2.projectPoints(points, cv2.Rodrigues(R)[0], T, lens.matrix, np.array(lens.distortion))
        turn = rig.R_rectified_left @ R.T
        flat = cv2.undistortPoints(pixels, lens.matrix, np.array(lens.distortion), R=turn, P=P)[:, 0]
        columns.append(flat[:, 0])
        rows.append(flat[:, 1])
    np.testing.assert_allclose(rows[0], rows[1], atol=0.02)  # the inverse of the distortion is iterated
    want = rig.camera.focal * rig.camera.baseline / rectified[:, 2]
    np.testing.assert_allclose(columns[0] - columns[1] + rig.camera.doffs, want, atol=0.02)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"translation": (0.12, 0.0, 0.0)}, "right camera to the right"),
        ({"translation": (-120.0, 0.0, 0.0)}, r"0.001 to 2 m long \(in metres\), got 120"),
        ({"translation": (0.0, -0.12, 0.0)}, "along -x"),
        ({"rotation": ((1.0, 0, 0), (0, 1.0, 0), (0, 0, -1.0))}, "must be a rotation matrix"),
        ({"rotation": ((2.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))}, "must be a rotation matrix"),
        ({"rotation": ((0.0, 0, 1.0), (0, 1.0, 0), (-1.0, 0, 0.0))}, "below 45 degrees"),
        ({"left": LENSES["left"] | {"focal": (0.3, 0.3)}}, "left.focal must be in pixels"),
        ({"right": LENSES["right"] | {"centre": (9000.0, 1.0)}}, "right.cx must be in pixels"),
        ({"left": LENSES["left"] | {"distortion": (0.1,)}}, "distortion must hold 0, 4, 5, 8, 12 or 14 numbers, got 1"),
        ({"left": LENSES["left"] | {"distortion": (np.nan,) * 4}}, "finite"),
        ({"width": 0}, "width"),
        ({"lens": 1}, "unknown key"),
    ],
)
def test_absurd_calibrations_are_named(change, words):
    with pytest.raises(InputError, match=words):
        parse(RawConfig, RAW | change, file="camera.toml")


def test_pictures_must_have_the_size_that_was_calibrated(pair):
    rig = make_rig(parse(RawConfig, RAW))
    with pytest.raises(InputError, match=r"right: must be 320 x 240 px, as the camera file says \(got '319 x 240'\)"):
        rig.rectify(pair[0], pair[1][:, 1:])
