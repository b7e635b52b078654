"""Pictures of every depth and kind, damaged ones, and pairs that are none."""

import numpy as np
import pytest
from PIL import Image
from skimage import data

from jaxbiped.errors import InputError
from jaxbiped.sensing.stereo import MatchParams, images, match
from jaxbiped.sensing.stereo.images import as_rgb, load_pair
from jaxbiped.sensing.stereo.order import check_order
from tests.sensing.stereo.pairs import ramp

PARAMS = MatchParams(num_disparities=64)


@pytest.fixture(scope="module")
def scene():
    return ramp(10.0, 0.0, 0.1)


def saved(folder, left, right, suffix="png"):
    paths = folder / f"left.{suffix}", folder / f"right.{suffix}"
    for path, image in zip(paths, (left, right), strict=True):
        Image.fromarray(image).save(path)
    return paths


@pytest.mark.parametrize("suffix", ["png", "pgm", "tiff", "bmp"])
def test_grey_pictures_come_back(tmp_path, scene, suffix):
    pair = load_pair(*saved(tmp_path, *scene[:2], suffix))
    for got, want in zip(pair, scene, strict=False):
        np.testing.assert_array_equal(got, want)


@pytest.mark.parametrize("bits", [10, 12, 16])
def test_16_bit_pictures_match_like_8_bit_ones(tmp_path, scene, bits):
    """Cameras of 10 or 12 bits are stored in 16: most of the range is empty."""
    deep = [image.astype(np.uint16) << (bits - 8) for image in scene[:2]]
    left, right = load_pair(*saved(tmp_path, *deep))
    assert left.dtype == np.uint8 and left.max() == 255
    assert match(left, right, PARAMS).valid.mean() > match(*scene[:2], PARAMS).valid.mean() - 0.01
    ratio = left.astype(float).mean() / right.astype(float).mean()
    assert ratio == pytest.approx(scene[0].mean() / scene[1].mean(), rel=0.01)  # one factor for both


@pytest.mark.parametrize("mode", ["RGB", "RGBA", "P", "LA", "CMYK", "I", "F"])
def test_modes(tmp_path, scene, mode):
    paths = []
    for name, image in zip(("left", "right"), scene, strict=False):
        paths.append(tmp_path / f"{name}.tiff")
        Image.fromarray(image).convert(mode).save(paths[-1])
    left, right = load_pair(*paths)
    assert left.dtype == right.dtype == np.uint8 and left.shape[:2] == scene[0].shape
    assert match(left, right, PARAMS).valid.mean() > 0.8
    assert as_rgb(left).shape == (scene[0].size, 3)


def test_pictures_of_different_size(tmp_path, scene):
    left, right = saved(tmp_path, scene[0], scene[1][:, 1:])
    with pytest.raises(InputError, match=r"right.png: right: must have the size of the left picture, 320 x 192"):
        load_pair(left, right)


@pytest.mark.parametrize("level", [0, 77, 255])
def test_blank_pictures(tmp_path, scene, level):
    paths = saved(tmp_path, scene[0], np.full_like(scene[0], level))
    with pytest.raises(InputError, match=rf"right.png: right: is blank: every pixel is {level}"):
        load_pair(*paths)


def test_a_black_16_bit_picture(tmp_path):
    paths = saved(tmp_path, *np.zeros((2, 20, 30), np.uint16))
    with pytest.raises(InputError, match="is blank: every pixel is 0"):
        load_pair(*paths)


@pytest.mark.parametrize("damage", ["cut", "flipped", "empty", "text", "folder", "none"])
def test_damaged_pictures(tmp_path, scene, damage, capfd):
    left, right = saved(tmp_path, *scene[:2])
    whole = left.read_bytes()
    if damage == "cut":
        left.write_bytes(whole[: len(whole) // 2])
    elif damage == "flipped":
        left.write_bytes(whole[:5000] + bytes(200) + whole[5200:])
    elif damage in ("empty", "text"):
        left.write_bytes(b"no picture" if damage == "text" else b"")
    else:
        left.unlink()
        if damage == "folder":
            left.mkdir()
    words = "no such file" if damage == "none" else "is no picture, or is damaged"
    with pytest.raises(InputError, match=words) as caught:
        load_pair(left, right)
    assert str(caught.value).startswith(f"{left}: left: ") and "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")  # no library says anything on its own


def test_too_large_a_picture(tmp_path, scene, monkeypatch):
    monkeypatch.setattr(images, "MOST_PIXELS", 1000)
    with pytest.raises(InputError, match=r"must have at most 1,000 pixels \(got '320 x 192'\)"):
        load_pair(*saved(tmp_path, *scene[:2]))


@pytest.mark.parametrize("synthetic", [True, False])
def test_swapped_pictures_are_found(scene, synthetic):
    left, right = scene[:2] if synthetic else data.stereo_motorcycle()[:2]
    check_order(left, right, PARAMS)
    with pytest.raises(InputError, match=r"left and right look swapped: \d+% of the pixels match as given, 9\d%"):
        check_order(right, left, PARAMS)


def test_pictures_that_are_no_pair(scene):
    other = ramp(10.0, 0.0, 0.1, seed=9)[1]
    with pytest.raises(InputError, match="of the pixels match: the pictures are no rectified pair"):
        check_order(scene[0], other, PARAMS)
    with pytest.raises(InputError, match="of the pixels match"):
        check_order(scene[0], scene[1][::-1].copy(), PARAMS)
    noise = np.random.default_rng(0).normal(128, 1.5, (2, 192, 320)).astype(np.uint8)
    with pytest.raises(InputError, match="hardly any texture"):
        check_order(*noise, PARAMS)
