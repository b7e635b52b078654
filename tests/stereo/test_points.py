"""Points against Z = f b / d, written out pixel by pixel."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxbiped.errors import InputError
from jaxbiped.sensing.config import CameraConfig
from jaxbiped.stereo import Disparity, StereoCamera, ideal, to_points

CAMERA = StereoCamera(focal=994.978, centre=(311.193, 254.877), baseline=0.193001, size=(741, 500), doffs=31.086)


def one_by_one(disparity, camera):
    """x, y, z, weight of every pixel, by a loop in float64."""
    rows = []
    for v in range(camera.size[1]):
        for u in range(camera.size[0]):
            d = float(disparity.value[v, u]) + camera.doffs
            if disparity.valid[v, u] and 1 / 16 <= d < np.inf:
                z = camera.focal * camera.baseline / d
                rows.append(
                    ((u - camera.centre[0]) * z / camera.focal, (v - camera.centre[1]) * z / camera.focal, z, 1)
                )
            else:
                rows.append((0, 0, 0, 0))
    return np.array(rows)


@settings(max_examples=40, deadline=None)
@given(
    st.integers(1, 6),
    st.integers(1, 6),
    st.floats(10, 4000),
    st.floats(0.01, 1),
    st.floats(-20, 200),
    st.integers(0, 2**32 - 1),
)
def test_closed_form(width, height, focal, baseline, doffs, seed):
    rng = np.random.default_rng(seed)
    value = (rng.integers(-320, 3200, (height, width)) / 16).astype(np.float32)
    disparity = Disparity(value, rng.random((height, width)) < 0.7)
    camera = StereoCamera(focal, (width / 3, height / 4), baseline, (width, height), doffs)
    got = np.stack(to_points(disparity, camera), axis=1)
    near_least = np.abs(value.reshape(-1) + doffs - 1 / 16) < 1e-4  # float32 and float64 may differ on which side
    want = one_by_one(disparity, camera)
    # 1e-5: float32; the parallax may be a small difference of large numbers
    tolerance = 1e-5 + 2e-5 * np.abs(doffs) / np.maximum(np.abs(value.reshape(-1) + doffs), 1 / 16)
    np.testing.assert_array_less(
        np.abs(got - want)[~near_least], (tolerance[:, None] * (1 + np.abs(want)))[~near_least]
    )


def test_motorcycle_depth():
    """The nearest and the farthest disparity of the Middlebury motorcycle pair."""
    value = np.zeros((500, 741), np.float32)
    value[100, 200], value[400, 700] = 59.90896, 7.1913557
    points = to_points(Disparity(value, value > 0), CAMERA)
    near, far = 100 * 741 + 200, 400 * 741 + 700
    assert points.z[near] == pytest.approx(994.978 * 0.193001 / (59.90896 + 31.086), rel=1e-6)
    assert points.z[far] == pytest.approx(994.978 * 0.193001 / (7.1913557 + 31.086), rel=1e-6)
    assert points.x[far] == pytest.approx((700 - 311.193) / 994.978 * points.z[far], rel=1e-6)
    assert points.weight.sum() == 2


def test_what_is_not_measured_has_no_weight():
    value = np.array([[np.nan, np.inf, -np.inf, 0.0, -3.0, 8.0, 8.0]], np.float32)
    valid = np.array([[True] * 6 + [False]])
    points = to_points(Disparity(value, valid), StereoCamera(100.0, (3.0, 0.0), 0.1, (7, 1)))
    np.testing.assert_array_equal(points.weight, [0, 0, 0, 0, 0, 1, 0])
    assert np.isfinite(np.stack(points)).all() and points.z[5] == pytest.approx(1.25) and points.z[6] == 0


def test_a_robot_camera():
    camera = ideal(CameraConfig())
    assert camera.size == (512, 384) and camera.centre == (255.5, 191.5) and camera.baseline == 0.12
    assert camera.focal == pytest.approx(226.49, abs=0.01) and camera.doffs == 0


def test_the_image_must_be_the_cameras():
    with pytest.raises(InputError, match=r"image: must be 741 x 500 px, as in the camera file \(got '3 x 2'\)"):
        to_points(Disparity(np.ones((2, 3), np.float32), np.ones((2, 3), bool)), CAMERA)
