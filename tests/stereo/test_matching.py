"""The matcher against disparities in closed form, and against the measured ones of a real pair."""

import cv2
import numpy as np
import pytest
from skimage import data

from jaxbiped.config import parse
from jaxbiped.errors import InputError
from jaxbiped.stereo import MatchParams, match
from tests.stereo.pairs import SHAPE, ramp

PARAMS = MatchParams(num_disparities=64)


def seen(disparity):
    """Pixels whose match lies in the right image."""
    return np.arange(disparity.shape[1]) >= disparity


def errors(found, disparity, where):
    error = (found.value - disparity)[found.valid & where]
    return error, error[np.abs(error) < 1]


@pytest.mark.parametrize("slopes", [(0.0, 0.0), (0.0, 0.15), (0.0, 0.25), (0.1, 0.1), (-0.08, 0.1)])
@pytest.mark.parametrize("contrast", [25.0, 8.0])
def test_textured_planes(slopes, contrast):
    across, down = slopes
    left, right, disparity = ramp(30.0 if across < 0 else 8.0, across, down, contrast=contrast)
    found, where = match(left, right, PARAMS), seen(disparity)
    error, core = errors(found, disparity, where)
    assert found.valid[where].mean() > 0.97  # of what is commonly visible
    assert abs(core.mean()) < 0.05 and core.std() < 0.2  # a matcher's own are 0.01 to 0.03 and 0.11 to 0.16
    assert (np.abs(error) > 1).mean() < 0.002
    assert found.valid[~seen(disparity - 2)].mean() < 0.03  # what the right image does not show
    assert (found.value[~found.valid] == 0).all()


def test_high_prices_bias_the_default_mode_of_opencv_on_a_floor():
    left, right, disparity = ramp(8.0, 0.0, 0.25)

    def bias(**values):
        found = match(left, right, PARAMS.model_copy(update=values))
        return errors(found, disparity, seen(disparity))[1].mean()

    dear = {"block_size": 5, "p1": 100, "p2": 400}
    assert bias(mode="5way", **dear) < bias(mode="3way", **dear) - 0.02
    for mode in ("5way", "3way", "hh"):
        assert abs(bias(mode=mode)) < 0.03


@pytest.mark.parametrize("noise", [0.5, 1.5, 3.0])
def test_plain_surfaces_are_unmeasured(noise):
    """They show each camera's own noise; without the check of agreement the matcher measures them, and wrongly."""
    area = slice(40, 150), slice(120, 230)
    left, right, disparity = ramp(20.0, 0.0, 0.05, noise=noise, plain=area)
    inside = slice(48, 142), slice(128, 222)
    found = match(left, right, PARAMS)
    assert found.valid[inside].mean() < 0.06
    assert found.valid[:30][seen(disparity)[:30]].mean() > 0.97
    if noise < 1:
        blind = match(left, right, PARAMS.model_copy(update={"agreement": -1.0}))
        assert blind.valid[inside].mean() > 0.5


@pytest.mark.parametrize("level", [0, 120, 255])
def test_blank_images_are_unmeasured(level):
    blank = np.full(SHAPE, level, np.uint8)
    assert not match(blank, blank, PARAMS).valid.any()


def test_no_margin_is_lost_for_what_is_far():
    left, right, _ = ramp(2.0, 0.0, 0.0)
    assert match(left, right, MatchParams(num_disparities=160)).valid[:, 8:].mean() > 0.97


def test_negative_disparities():
    """Of cameras that squint: the same pair, the right image shifted by 20 px."""
    left, right, disparity = ramp(10.0, 0.0, 0.1)
    shifted = np.roll(right, 20, axis=1)
    found = match(left, shifted, MatchParams(num_disparities=64, min_disparity=-32))
    inside = np.s_[:, 40:-40]
    error = (found.value - (disparity - 20))[inside][found.valid[inside]]
    assert found.valid[inside].mean() > 0.97 and np.abs(np.mean(error)) < 0.05 and (found.value[inside].min() < -5)


def test_colour_is_read_as_grey_and_threads_do_not_matter():
    left, right, _ = ramp()
    rgb = [np.repeat(image[..., None], 3, axis=-1) for image in (left, right)]
    first = match(left, right, PARAMS)
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    second = match(*rgb, PARAMS)
    cv2.setNumThreads(before)
    np.testing.assert_array_equal(first.value, second.value)
    np.testing.assert_array_equal(first.valid, second.valid)


def test_the_motorcycle_pair(capsys):
    """Middlebury 2014, as scikit-image ships it with its measured disparities.

    The measured fraction is of all pixels, also of the 9 % whose truth says that the right image does not show them,
    and of the 7 % whose truth is unknown.
    """
    left, right, truth = data.stereo_motorcycle()
    known = np.isfinite(truth)
    found = match(left, right, PARAMS)
    error, core = errors(found, truth, known)
    seen_twice = visible_in_both(truth)
    measured, beyond = found.valid.mean(), (np.abs(error) > 1).mean()
    with capsys.disabled():
        print(
            f"\nmotorcycle: bias {core.mean():+.3f} px (median {np.median(error):+.3f}), sd {core.std():.3f} px within "
            f"1 px, {beyond:.1%} beyond 1 px; measured {measured:.1%} of all pixels, "
            f"{found.valid[seen_twice].mean():.1%} of those visible in both"
        )
    assert abs(core.mean()) < 0.1 and abs(np.median(error)) < 0.1
    assert measured > 0.88 and found.valid[seen_twice].mean() > 0.94
    assert beyond < 0.09


def visible_in_both(truth):
    """Pixels of known disparity whose match is in the right image, and hidden there by nothing nearer."""
    rows, columns = truth.shape
    visible = np.zeros(truth.shape, bool)
    for i in range(rows):
        j = np.flatnonzero(np.isfinite(truth[i]))
        d = truth[i, j]
        target = np.round(j - d).astype(int)
        j, d, target = (v[target >= 0] for v in (j, d, target))
        nearest = np.full(columns, -1.0)
        np.maximum.at(nearest, target, d)
        visible[i, j] = d >= nearest[target] - 1
    return visible


def test_images_that_are_no_pair():
    image = np.zeros((20, 30), np.uint8)
    with pytest.raises(InputError, match=r"right: must have the size of the left image, 30 x 20 \(got '29 x 20'\)"):
        match(image, image[:, 1:], PARAMS)
    for bad in (image.astype(float), image[0], np.zeros((20, 30, 4), np.uint8), np.zeros((0, 30), np.uint8)):
        with pytest.raises(InputError, match="left: must be an 8-bit image"):
            match(bad, image, PARAMS)


@pytest.mark.parametrize("shape", [(1, 1), (3, 5), (2, 400)])
def test_tiny_images_are_handled(shape):
    image = np.random.default_rng(0).integers(0, 255, shape).astype(np.uint8)
    assert match(image, image).value.shape == shape


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"num_disparities": 100}, "multiple of 16"),
        ({"num_disparities": 0}, "num_disparities"),
        ({"block_size": 4}, "block_size must be odd, got 4"),
        ({"agreement_window": 8}, "agreement_window must be odd, got 8"),
        ({"p1": 400}, r"p2 must be above p1 \(400\), got 250"),
        ({"mode": "best"}, "mode"),
        ({"blocks": 1}, "unknown key"),
    ],
)
def test_bad_parameters_are_named(values, words):
    with pytest.raises(InputError, match=words):
        parse(MatchParams, values)
