"""Elevation maps of every kind of file come back as they were; whatever is wrong with one is said in one line."""

import io

import numpy as np
import pytest
from PIL import Image

from jaxbiped.errors import InputError
from jaxbiped.formats import Elevation, load_elevation, save_elevation
from jaxbiped.mapping.grid import MOST_CELLS
from tests.nasty_files import read_or_refuse, same, spoilt
from tests.stereo.test_images import png, tiff

HEIGHTS = np.round(np.random.default_rng(0).uniform(-0.2, 1.0, (5, 7)), 3)
GREY = np.random.default_rng(1).integers(0, 256, (5, 7)).astype(np.uint8)
DEEP = np.random.default_rng(2).integers(0, 65536, (5, 7)).astype(np.uint16)
PIXELS = {"cell": 0.04, "range": (-0.25, 1.0)}
ASC = """ncols 3
nrows 2
xllcorner 10
yllcorner -4.5
cellsize 0.5
NODATA_value -1
0.25 0.5 -1
1 2 3e0
"""


def saved(tmp_path, name, content):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def npz(**arrays):
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


def picture(image, kind="PNG", **options):
    stream = io.BytesIO()
    (image if isinstance(image, Image.Image) else Image.fromarray(image)).save(stream, kind, **options)
    return stream.getvalue()


def refused(tmp_path, name, content, **options):
    with pytest.raises(InputError) as caught:
        load_elevation(saved(tmp_path, name, content), **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_npz_comes_back(tmp_path):
    holed = HEIGHTS.copy()
    holed[2, 3] = np.nan
    save_elevation(Elevation(holed, np.array([1.0, -2.0]), 0.04), tmp_path / "a.npz")
    found = load_elevation(tmp_path / "a.npz")
    np.testing.assert_array_equal(found.heights, holed)
    assert found.origin_xy.tolist() == [1, -2] and found.pitch == 0.04 and found.holes == 1
    assert found.size_xy == pytest.approx((0.24, 0.16))
    bare = load_elevation(saved(tmp_path, "b.npz", npz(heights=HEIGHTS.astype(np.float32), pitch=1)))
    assert bare.origin_xy.tolist() == [0, 0] and bare.pitch == 1


def test_asc_comes_back(tmp_path):
    found = load_elevation(saved(tmp_path, "a.asc", ASC))
    np.testing.assert_array_equal(found.heights, [[1, 2, 3], [0.25, 0.5, np.nan]])
    assert found.pitch == 0.5 and found.origin_xy.tolist() == [10.25, -4.25]


def test_asc_variants(tmp_path):
    """Any case, centres, dx and dy, no corner, the default mark, keys of others, numbers in any number of lines."""
    one = load_elevation(saved(tmp_path, "a.asc", "NCOLS 2 NROWS 2\nXLLCENTER 1 yllCenter 2 DX 2 DY 2\n1 2\n-9999\n4"))
    np.testing.assert_array_equal(one.heights, [[np.nan, 4], [1, 2]])
    assert one.pitch == 2 and one.origin_xy.tolist() == [1, 2]
    two = load_elevation(saved(tmp_path, "b.asc", "ncols 2\nnrows 2\ncellsize 1\nprojection 7\nnan 2\n3 4\n"))
    np.testing.assert_array_equal(two.heights, [[3, 4], [np.nan, 2]])
    assert two.origin_xy.tolist() == [0.5, 0.5]


@pytest.mark.parametrize("what, content", list(same(ASC.encode())))
def test_asc_reads_the_same(tmp_path, what, content):
    np.testing.assert_array_equal(load_elevation(saved(tmp_path, "a.asc", content)).heights[0], [1, 2, 3], what)


@pytest.mark.parametrize("name, kind", [("a.png", "PNG"), ("a.tif", "TIFF"), ("a.tiff", "TIFF")])
@pytest.mark.parametrize("image", [GREY, DEEP], ids=["8 bits", "16 bits"])
def test_grey_pictures_come_back(tmp_path, name, kind, image):
    """The top row is that of greatest y; the darkest and the brightest value there can be are the ends of the range."""
    found = load_elevation(saved(tmp_path, name, picture(image, kind)), **PIXELS)
    full = np.iinfo(image.dtype).max
    np.testing.assert_allclose(found.heights, (image / full * 1.25 - 0.25)[::-1], atol=1e-12)
    assert found.pitch == 0.04 and found.origin_xy.tolist() == [0, 0] and found.holes == 0


def test_colour_of_equal_channels_is_grey(tmp_path):
    plain = load_elevation(saved(tmp_path, "a.png", picture(GREY)), **PIXELS).heights
    deep = load_elevation(saved(tmp_path, "a.png", picture(DEEP)), **PIXELS).heights
    palette = Image.fromarray(GREY).convert("P")
    for name, content, expected in (
        ("rgb.png", picture(np.repeat(GREY[..., None], 3, 2)), plain),
        ("rgba.png", picture(np.dstack([GREY] * 3 + [np.full_like(GREY, 255)])), plain),
        ("palette.png", picture(palette), plain),
        ("rgb.tif", picture(np.repeat(GREY[..., None], 3, 2), "TIFF"), plain),
        ("deep.png", png(np.repeat(DEEP[..., None], 3, 2)), deep),
        ("deep.tif", tiff(np.repeat(DEEP[..., None], 3, 2)), deep),
        ("packed.tif", tiff(DEEP[..., None], compression="zlib", predictor=True), deep),
        ("white.tif", tiff(65535 - DEEP[..., None], photometric="miniswhite"), deep),
        ("white8.tif", tiff(255 - GREY[..., None], photometric="miniswhite"), plain),
    ):
        found = load_elevation(saved(tmp_path, name, content), **PIXELS).heights
        np.testing.assert_allclose(found, expected, atol=1e-12, err_msg=name)


@pytest.mark.parametrize("channels", [2, 4])
@pytest.mark.parametrize("deep", [False, True])
def test_what_is_not_opaque_is_a_hole(tmp_path, channels, deep):
    """Alpha 0 in any colour, and half transparent ones."""
    image, full = (DEEP, 65535) if deep else (GREY, 255)
    layers = np.dstack([image] * (channels - 1) + [np.full_like(image, full)])
    layers[1, 2, -1], layers[3, 3, -1] = 0, full // 2
    layers[1, 2, :-1] = np.arange(channels - 1)
    content = png(layers) if deep else picture(layers)
    found = load_elevation(saved(tmp_path, "a.png", content), **PIXELS)
    expected = (image / full * 1.25 - 0.25)[::-1].copy()
    expected[5 - 1 - 1, 2] = expected[5 - 1 - 3, 3] = np.nan
    np.testing.assert_allclose(found.heights, expected, atol=1e-12)
    assert found.holes == 2


def test_floating_point_pictures_hold_metres(tmp_path):
    holed = HEIGHTS.astype(np.float32)
    holed[0, 0] = np.nan
    found = load_elevation(saved(tmp_path, "a.tif", tiff(holed[..., None])), cell=0.1)
    np.testing.assert_array_equal(found.heights, holed[::-1])
    assert "range: goes with whole numbers" in refused(tmp_path, "a.tif", tiff(holed[..., None]), **PIXELS)


def test_a_value_can_be_a_hole(tmp_path):
    found = load_elevation(saved(tmp_path, "a.png", picture(GREY)), hole=float(GREY[1, 1]), **PIXELS)
    np.testing.assert_array_equal(np.isnan(found.heights), (GREY[1, 1] == GREY)[::-1])


def test_scale_is_of_all_axes(tmp_path):
    path = saved(tmp_path, "a.asc", ASC)
    whole, half = load_elevation(path), load_elevation(path, scale=0.5)
    np.testing.assert_array_equal(half.heights, whole.heights / 2)
    assert half.pitch == 0.25 and half.origin_xy.tolist() == [5.125, -2.125]
    field = half.field(floor=0.25)
    np.testing.assert_allclose(field.heights, whole.heights / 2 - 0.25)


@pytest.mark.parametrize(
    "options, said",
    [
        ({"cell": 0.0, "range": (0.0, 1.0)}, "cell: must be finite and above 0 (got 0.0)"),
        ({"cell": float("nan"), "range": (0.0, 1.0)}, "cell: must be finite and above 0"),
        ({"cell": 0.04, "range": (0.0, 1.0), "scale": 0.0}, "scale: must be finite and above 0 (got 0.0)"),
        ({"cell": 0.04, "range": (0.0, 1.0), "scale": -1.0}, "scale: must be finite and above 0"),
        ({"cell": 0.04, "range": (1.0, 0.0)}, "range: must be LOW and HIGH [m], LOW below HIGH"),
        ({"cell": 0.04, "range": (1.0, 1.0)}, "range: must be LOW and HIGH [m]"),
        ({"cell": 0.04, "range": (0.0, float("nan"))}, "range: must be LOW and HIGH [m]"),
        ({"range": (0.0, 1.0)}, "cell: is required for a picture"),
        ({"cell": 0.04}, "range: is required: heights LOW and HIGH [m] of the values 0 and 255"),
    ],
)
def test_options_of_pictures_are_checked(tmp_path, options, said):
    assert said in refused(tmp_path, "a.png", picture(GREY), **options)
    assert f"terrain.{said}" in refused(tmp_path, "a.png", picture(GREY), prefix="terrain.", **options)


@pytest.mark.parametrize("name, content", [("a.asc", ASC), ("a.npz", npz(heights=HEIGHTS, pitch=0.1))])
@pytest.mark.parametrize("option", ["cell", "range", "hole"])
def test_options_of_pictures_do_not_go_with_other_files(tmp_path, name, content, option):
    value = (0.0, 1.0) if option == "range" else 0.5
    assert f"{option}: goes with pictures only" in refused(tmp_path, name, content, **{option: value})


def test_maps_that_are_none_are_refused(tmp_path):
    holes, flat = np.full((3, 3), np.nan), np.full((3, 3), 0.3)
    for heights, said in (
        (holes, "must hold heights; all are holes (NaN, no data or transparent) (got '9 holes')"),
        (np.full((3, 3), np.inf), "all are holes"),
        (flat, "must hold heights that differ; all are 0.3 m"),
        (np.ones((1, 5)), "must have at least 2 x 2 heights (got '1 x 5')"),
        (np.ones((5, 1)), "at least 2 x 2"),
        (np.ones((0, 0)), "at least 2 x 2"),
        (np.ones((1, 1)), "at least 2 x 2"),
        (np.array([[0, 1], [2, -32768.0]]), "must hold heights within 10,000 m of 0; a mark"),
        (np.ones(7), "heights: must be an array [P, Q]"),
        (np.ones((2, 2, 2)), "heights: must be an array [P, Q]"),
        (np.array([["a", "b"], ["c", "d"]]), "heights: must be real numbers"),
        (np.ones((2, 2), complex), "heights: must be real numbers"),
        (np.array([[None, 1], [2, 3]]), "pickled objects, which are rejected"),
    ):
        assert said in refused(tmp_path, "a.npz", npz(heights=heights, pitch=0.1)), said
    clear = np.dstack([GREY] * 3 + [np.zeros_like(GREY)])
    assert "all are holes" in refused(tmp_path, "a.png", picture(clear), **PIXELS)
    assert "must hold heights that differ" in refused(tmp_path, "a.png", picture(0 * GREY), **PIXELS)
    assert "at least 2 x 2" in refused(tmp_path, "a.png", picture(GREY[:1]), **PIXELS)
    assert "at least 2 x 2" in refused(tmp_path, "a.png", picture(DEEP[:, :1]), **PIXELS)
    assert "at least 2 x 2" in refused(tmp_path, "a.tif", tiff(DEEP[:1, :, None]), **PIXELS)


def test_sixteen_million_heights_are_refused_before_they_are_unpacked(tmp_path):
    """An npz whose header says so and whose data is not there; a picture of 4 kB; a grid of a header alone."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (4000, 4000)})
    import zipfile

    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("heights.npy", header.getvalue())
        archive.writestr("pitch.npy", npz(p=0.1)[:10])
    big = Image.new("L", (4000, 4000))
    said = f"must have at most {MOST_CELLS:,} heights (got '4000 x 4000')"
    assert said in refused(tmp_path, "a.npz", stream.getvalue())
    assert said in refused(tmp_path, "a.png", picture(big), **PIXELS)
    assert said in refused(tmp_path, "a.tif", picture(big.convert("I;16"), "TIFF", compression="tiff_lzw"), **PIXELS)
    assert said in refused(tmp_path, "a.asc", "ncols 4000 nrows 4000 cellsize 1\n1 2 3")


def test_colours_are_refused(tmp_path):
    for name, image in (("a.png", GREY), ("a.tif", DEEP)):
        layers = np.repeat(image[..., None], 3, 2)
        layers[2, 4, 1] ^= 1
        content = picture(layers) if image is GREY else tiff(layers)
        assert "pixel (4, 2): must be grey: its channels differ" in refused(tmp_path, name, content, **PIXELS)


@pytest.mark.parametrize(
    "old, new, said",
    [
        ("ncols 3\n", "", "ncols: is missing from the header"),
        ("ncols 3", "ncols 2.5", "ncols: must be a whole number above 0 (got 2.5)"),
        ("nrows 2", "nrows -2", "nrows: must be a whole number above 0"),
        ("nrows 2", "nrows two", "nrows: must be a number (got 'two')"),
        ("cellsize 0.5", "cellsize 0", "cellsize: must be a number above 0 (got 0.0)"),
        ("cellsize 0.5", "dx 1 dy 2", "dx, dy: must be equal: cells are square"),
        ("ncols 3", "ncols 3 NCOLS 3", "ncols: must be given once"),
        ("xllcorner 10", "xllcorner nan", "xllcorner: must be finite"),
        ("1 2 3e0", "1 2", "must hold nrows x ncols = 6 heights after its header (got 5)"),
        ("1 2 3e0", "1 2 3 4", "= 6 heights after its header (got 7)"),
        ("1 2 3e0", "1 2 0,5", "must hold numbers after its header (got '0,5')"),
        ("NODATA_value -1", "", "must hold heights"),
    ],
)
def test_headers_are_checked(tmp_path, old, new, said):
    text = ASC.replace(old, new)
    if "NODATA" in old:
        text = text.replace(" -1\n", " -1e30\n")
    assert said in refused(tmp_path, "a.asc", text)


@pytest.mark.parametrize(
    "arrays, said",
    [
        ({"heights": HEIGHTS}, "pitch: is missing; an elevation map holds heights, pitch, origin_xy"),
        ({"pitch": 0.1}, "heights: is missing"),
        ({"heights": HEIGHTS, "pitch": 0.1, "x": 1}, "x: unknown key"),
        ({"heights": HEIGHTS, "pitch": 0.0}, "pitch: must be one number above 0 [m]"),
        ({"heights": HEIGHTS, "pitch": [0.1, 0.1]}, "pitch: must be one number above 0 [m]"),
        ({"heights": HEIGHTS, "pitch": np.nan}, "pitch: must be one number above 0 [m]"),
        ({"heights": HEIGHTS, "pitch": 0.1, "origin_xy": [0, np.inf]}, "origin_xy: must be two finite numbers"),
        ({"heights": HEIGHTS, "pitch": 0.1, "origin_xy": 0}, "origin_xy: must be two finite numbers"),
    ],
)
def test_keys_are_checked(tmp_path, arrays, said):
    assert said in refused(tmp_path, "a.npz", npz(**arrays))


def test_files_that_are_none(tmp_path):
    assert "must be an elevation map, one of .npz, .png" in refused(tmp_path, "a.jpg", b"")
    for name in ("a.png", "a.npz", "a.asc"):
        with pytest.raises(InputError, match="no such file"):
            load_elevation(tmp_path / name, **(PIXELS if name == "a.png" else {}))
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(InputError, match=r"folder\.png: cannot be read"):
        load_elevation(tmp_path / "folder.png", **PIXELS)
    assert "must be a PNG or TIFF picture" in refused(tmp_path, "a.png", picture(GREY, "JPEG"), **PIXELS)
    single = io.BytesIO()
    np.save(single, HEIGHTS)
    assert "is not an .npz, or is cut short" in refused(tmp_path, "a.npz", single.getvalue())


WHOLE = {
    "a.asc": ASC.encode(),
    "a.npz": npz(heights=HEIGHTS, pitch=0.1),
    "a.png": picture(GREY),
    "deep.png": png(DEEP[..., None]),
    "a.tif": picture(GREY, "TIFF"),
    "deep.tif": tiff(DEEP[..., None], compression="zlib"),
}


@pytest.mark.parametrize("name", WHOLE)
def test_spoilt_files_are_refused_in_our_words(tmp_path, name):
    """Cut short and with other bytes: refused in one line, or read as something that is a map."""
    options = PIXELS if name.endswith(("png", "tif")) else {}
    rng = np.random.default_rng(0)
    whole = WHOLE[name]
    flipped = [
        (
            f"bytes {k}",
            bytes(
                np.where(rng.random(len(whole)) < 0.02, rng.integers(0, 256, len(whole)), list(whole)).astype(np.uint8)
            ),
        )
        for k in range(60)
    ]
    for what, content in [*spoilt(whole, max(1, len(whole) // 80)), *flipped]:
        found = read_or_refuse(lambda path: load_elevation(path, **options), saved(tmp_path, name, content), what)
        assert found is None or (min(found.heights.shape) >= 2 and np.nanmax(np.abs(found.heights)) <= 1e4)
    cut = saved(tmp_path, name, whole[: len(whole) * 2 // 3])
    with pytest.raises(InputError):
        load_elevation(cut, **options)
