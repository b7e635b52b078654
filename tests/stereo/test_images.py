"""Pictures of every depth and kind, damaged ones, and pairs that are none."""

import io
import struct
import zlib

import numpy as np
import pytest
import tifffile
from PIL import Image, ImageOps
from skimage import data

from jaxbiped.errors import InputError
from jaxbiped.stereo import MatchParams, images, match
from jaxbiped.stereo.images import as_rgb, load_pair
from jaxbiped.stereo.order import check_order
from tests.stereo.pairs import ramp

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


def png(image):
    """A PNG file of 16 bits, grey with alpha too, which no library at hand writes."""
    height, width, channels = image.shape

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 16, {1: 0, 2: 4, 3: 2, 4: 6}[channels], 0, 0, 0)
    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in image)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def ppm(image):
    """A PGM or PPM file of 16 bits."""
    height, width, channels = image.shape
    return b"P%d\n# deep\n%d %d\n65535\n" % (5 if channels == 1 else 6, width, height) + image.astype(">u2").tobytes()


def tiff(image, **how):
    stream = io.BytesIO()
    colours = "rgb" if image.shape[-1] > 2 else how.pop("photometric", "minisblack")
    alpha = {"extrasamples": ["unassalpha"]} if image.shape[-1] in (2, 4) else {}
    image = image[..., 0] if image.shape[-1] == 1 else image
    tifffile.imwrite(stream, image, photometric=colours, planarconfig="contig", **alpha, **how)
    return stream.getvalue()


CHANNELS = {"grey": 1, "grey and alpha": 2, "colour": 3, "colour and alpha": 4}
DEEP_FILES = {
    "png": png,
    "ppm": ppm,
    "tiff": tiff,
    "big tiff": lambda image: tiff(image, bigtiff=True),
    "compressed tiff": lambda image: tiff(image, compression="zlib", predictor=True),
    "other end first": lambda image: tiff(image, byteorder=">"),
    "white is 0": lambda image: tiff(65535 - image, photometric="miniswhite"),
    "float": lambda image: tiff((image / 65535).astype(np.float32)),
    "double": lambda image: tiff(image / 65535),
    "32 bits": lambda image: tiff(image.astype(np.uint32) * 65537),
}


@pytest.mark.parametrize("channels", CHANNELS)
@pytest.mark.parametrize("kind", DEEP_FILES)
def test_ten_bits_in_sixteen_are_kept_in_every_kind_of_file(tmp_path, scene, kind, channels):
    """What 10 bits hold of a dark pair comes through, or the kind is refused by name; the low byte is never lost."""
    number = CHANNELS[channels]
    if (kind == "ppm" and number in (2, 4)) or (kind == "white is 0" and number > 2):
        pytest.skip("there is no such file")
    paths = []
    for name, image in zip(("left", "right"), scene, strict=False):
        deep = np.repeat((image.astype(np.uint16) * 4 + 3)[..., None], number, axis=-1)
        if number in (2, 4):
            deep[..., -1] = 65535
        paths.append(tmp_path / f"{name}.any")
        paths[-1].write_bytes(DEEP_FILES[kind](deep))
    if kind not in ("png", "ppm") and number == 2:
        with pytest.raises(InputError, match=r"not supported(: TIFF of \d+ bits per sample with such channels)?$"):
            load_pair(*paths)
        return
    for got, image in zip(load_pair(*paths), scene, strict=False):
        expected = image * 255.0 / max(np.percentile(view, 99.9) for view in scene[:2])
        error = np.abs(got.reshape(*image.shape, -1).mean(-1) - np.minimum(expected, 255))
        assert error.max() < 2, error.max()  # grey levels; with the high bytes alone it is 40


def test_colours_are_kept_in_16_bits(tmp_path):
    """Red stays red, and light is that of the eye."""
    colours = np.random.default_rng(3).integers(0, 1024, (2, 20, 30, 3)).astype(np.uint16)
    for kind in ("png", "ppm", "tiff"):
        paths = [tmp_path / f"{name}.{kind}" for name in ("left", "right")]
        for path, image in zip(paths, colours, strict=True):
            path.write_bytes(DEEP_FILES[kind](image))
        for got, image in zip(load_pair(*paths), colours, strict=True):
            np.testing.assert_allclose(got, image / 1023 * 255, atol=1.5)


@pytest.mark.parametrize("suffix", ["png", "jpg", "tiff"])
@pytest.mark.parametrize("deep", [False, True])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_exif_orientations_are_honoured(tmp_path, suffix, deep, orientation):
    """Stored turned, with the tag that says so: read upright, in any depth."""
    upright = np.zeros((24, 40), np.uint8)
    upright[:8, :16], upright[8:, :8] = 255, 128
    inverse = {6: 8, 8: 6}.get(orientation, orientation)
    exif = Image.Exif()
    exif[0x0112] = inverse
    turned = Image.fromarray(upright)
    turned.getexif()[0x0112] = inverse
    stored = np.asarray(ImageOps.exif_transpose(turned))
    exif[0x0112] = orientation
    path = tmp_path / f"a.{suffix}"
    if not deep:
        Image.fromarray(stored).save(path, exif=exif, **({"quality": 100} if suffix == "jpg" else {}))
    elif suffix == "tiff":
        colour = np.repeat(stored[..., None], 3, axis=-1).astype(np.uint16) * 257
        path.write_bytes(tiff(colour, extratags=[(0x0112, "H", 1, orientation, True)]))
    elif suffix == "png":
        colour = png(np.repeat(stored[..., None], 3, axis=-1).astype(np.uint16) * 257)
        data = exif.tobytes().removeprefix(b"Exif\0\0")
        chunk = struct.pack(">I", len(data)) + b"eXIf" + data + struct.pack(">I", zlib.crc32(b"eXIf" + data))
        path.write_bytes(colour[:33] + chunk + colour[33:])
    else:
        pytest.skip("JPEG has 8 bits")
    got = images.read(path, "left").astype(float)
    grey = got.mean(-1) if got.ndim == 3 else got
    np.testing.assert_allclose(grey / grey.max(), upright / 255, atol=0.05)


@pytest.mark.parametrize("bits", [1, 2, 4, 8])
def test_few_bits_are_spread_over_the_whole_range(tmp_path, bits):
    values = np.tile(np.arange(2**bits, dtype=np.uint8), (16, 256 >> bits))
    palette = Image.fromarray(values, "P")
    palette.putpalette(np.repeat(np.linspace(0, 255, 2**bits).round().astype(np.uint8), 3).tobytes())
    palette.save(tmp_path / "palette.png", bits=bits)
    got = images.read(tmp_path / "palette.png", "left")
    np.testing.assert_array_equal(got.reshape(16, 256, -1)[..., 0], np.round(values * 255.0 / (2**bits - 1)))


def test_a_kind_of_tiff_that_is_not_supported_is_not_called_damaged(tmp_path):
    for name, image, how in (
        ("half", np.ones((9, 9, 3), np.float16), {}),
        ("cmyk", np.ones((9, 9, 4), np.uint16), {"photometric": "separated"}),
    ):
        tifffile.imwrite(tmp_path / f"{name}.tiff", image, **{"photometric": "rgb"} | how)
        with pytest.raises(InputError, match="not supported"):
            images.read(tmp_path / f"{name}.tiff", "left")


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
    words = {"none": "no such file", "folder": "is a directory"}.get(damage, "is not a picture, or is damaged")
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
    with pytest.raises(InputError, match="of the pixels match: the pictures are not a rectified pair"):
        check_order(scene[0], other, PARAMS)
    with pytest.raises(InputError, match="of the pixels match"):
        check_order(scene[0], scene[1][::-1].copy(), PARAMS)
    noise = np.random.default_rng(0).normal(128, 1.5, (2, 192, 320)).astype(np.uint8)
    with pytest.raises(InputError, match="hardly any texture"):
        check_order(*noise, PARAMS)
