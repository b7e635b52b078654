"""ROS maps: the rules of `map_server` pixel by pixel, and pictures that are no maps."""

import math
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from PIL import Image

from jaxbiped.core.class_grid import ClassGrid
from jaxbiped.errors import InputError
from jaxbiped.formats import ros_map
from jaxbiped.mapping.grid import Cell
from jaxbiped.mapping.inflation import inflate

DATA = Path(__file__).parent.parent / "data"
U, F, X = int(Cell.UNMEASURED), int(Cell.FLOOR), int(Cell.OBSTACLE)
SHEET = {
    "image": "m.png",
    "resolution": 0.05,
    "origin": [-1.0, 2.0, 0.0],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
}
RAMP = np.array([[0, 89, 90, 128, 204, 205, 206, 254, 255]], np.uint8)


@pytest.fixture
def write(tmp_path):
    def write(picture=RAMP, name="m.png", **changes):
        if isinstance(picture, np.ndarray):
            Image.fromarray(picture).save(tmp_path / name)
        elif isinstance(picture, bytes):
            (tmp_path / name).write_bytes(picture)
        sheet = {key: value for key, value in (SHEET | {"image": name} | changes).items() if value is not None}
        (tmp_path / "m.yaml").write_text(yaml.safe_dump(sheet))
        return tmp_path / "m.yaml"

    return write


def refused(path):
    with pytest.raises(InputError) as caught:
        ros_map.load(path)
    return str(caught.value)


def by_pixel(x, alpha, negate, mode, occupied, free):
    """The rule for one pixel, in words of its documentation."""
    if negate:
        x = 255 - x
    if mode == "raw":
        if x > 100:
            return U
        p = x / 100
    else:
        if mode == "scale" and alpha < 255:
            return U
        p = (255 - x) / 255
    return X if p > occupied else F if p < free else U


@pytest.mark.parametrize("mode", ["trinary", "scale", "raw", None])
@pytest.mark.parametrize("negate", [0, 1, True])
def test_every_grey_value(write, mode, negate):
    picture = np.zeros((2, 256, 2), np.uint8)
    picture[..., 0] = np.arange(256)
    picture[0, :, 1], picture[1, :, 1] = 255, 254
    grid = ros_map.load(write(picture, negate=negate, mode=mode))
    for row, alpha in ((1, 255), (0, 254)):  # the picture's top row is the grid's last
        expected = [by_pixel(x, alpha, negate, mode, 0.65, 0.196) for x in range(256)]
        assert grid.classes[row].tolist() == expected


def test_rows_are_turned_over_and_the_origin_is_the_lower_left(write):
    grid = ros_map.load(write(np.array([[0, 254], [205, 254], [254, 254]], np.uint8)))
    assert grid.classes.tolist() == [[F, F], [U, F], [X, F]]
    assert grid.origin_xy.tolist() == [-1.0, 2.0] and grid.pitch == 0.05 and (grid.levels == 0).all()
    assert grid.cell_at((-0.99, 2.14)) == (2, 0)


def test_named_by_yaml_or_by_picture_of_any_grey_kind(write, tmp_path):
    expected = ros_map.load(write()).classes
    np.testing.assert_array_equal(ros_map.load(tmp_path / "m.png").classes, expected)
    np.testing.assert_array_equal(ros_map.load(write(name="m.pgm")).classes, expected)
    np.testing.assert_array_equal(ros_map.load(tmp_path / "m.pgm").classes, expected)
    np.testing.assert_array_equal(ros_map.load(write(np.repeat(RAMP[..., None], 3, -1))).classes, expected)
    np.testing.assert_array_equal(ros_map.load(write(RAMP > 127)).classes, [[X] * 3 + [F] * 6])
    plain = b"P2\n# written by hand\n9 1\n255\n" + b" ".join(b"%d" % x for x in RAMP[0]) + b"\n"
    np.testing.assert_array_equal(ros_map.load(write(plain, "m.pgm")).classes, expected)


def test_keys_that_map_server_does_not_know_are_ignored(write):
    grid = ros_map.load(write(map_type="occupancy", frame_id="map", occupied_tresh=0.65, **{"3": None}))
    np.testing.assert_array_equal(grid.classes, ros_map.load(write()).classes)


@pytest.mark.parametrize("yaw", ["1e-9", 1e-9, -1e-9, 2 * math.pi, 0])
def test_a_yaw_that_is_rounding_is_none(write, yaw):
    assert ros_map.load(write(origin=[-1.0, 2.0, yaw])).yaw == 0


@pytest.mark.parametrize("yaw", [1.0, -2.0, math.pi / 2, 7.0])
def test_a_yaw_turns_the_map_about_its_origin(write, yaw):
    """Each cell's centre is where `map_server` says: origin + R(yaw) (column, row) resolution; and back."""
    grid = ros_map.load(write(np.tile(RAMP, (5, 1)), origin=[-1.0, 2.0, yaw]))
    cells = np.array([(i, j) for i in range(5) for j in range(9)])
    along = (cells[:, ::-1] + 0.5) * 0.05
    turned = complex(math.cos(yaw), math.sin(yaw)) * (along[:, 0] + 1j * along[:, 1])
    expected = np.stack([turned.real - 1.0, turned.imag + 2.0], axis=1)
    np.testing.assert_allclose(grid.centres_xy(cells), expected, atol=1e-12)
    assert [grid.cell_at(tuple(xy)) for xy in expected] == [tuple(cell) for cell in cells.tolist()]
    outside = turned[0] - 0.06 * complex(math.cos(yaw), math.sin(yaw))
    with pytest.raises(InputError, match=r"turned by .* rad about \(-1, 2\) m"):
        grid.cell_at((outside.real - 1.0, outside.imag + 2.0))


def test_deep_and_turned_pictures_are_named(write, tmp_path):
    deep = np.repeat((RAMP.astype(np.uint16) * 257)[..., None], 3, axis=-1)
    (tmp_path / "deep.png").write_bytes(cv2.imencode(".png", deep)[1].tobytes())
    (tmp_path / "deep.pgm").write_bytes(b"P5 2 1 65535\n1234")
    for name in ("deep.png", "deep.pgm"):
        assert "must have 8 bits per pixel" in refused(write(None, name)), name
    exif = Image.Exif()
    exif[0x0112] = 6
    Image.fromarray(RAMP).save(tmp_path / "turned.png", exif=exif)
    assert "map_server does not turn pictures by their EXIF orientation (got 6)" in refused(write(None, "turned.png"))


def test_an_absolute_picture_path(write, tmp_path):
    (tmp_path / "far").mkdir()
    Image.fromarray(RAMP).save(tmp_path / "far" / "p.png")
    assert ros_map.load(write(None, image=str(tmp_path / "far" / "p.png"))).shape == (1, 9)


BAD_SHEETS = [
    ({"image": None}, "image: is required"),
    ({"resolution": None}, "resolution: is required"),
    ({"resolution": 0}, "resolution: must be greater than 0 (got 0)"),
    ({"resolution": -0.05}, "resolution: must be greater than 0 (got -0.05)"),
    ({"resolution": math.nan}, "resolution: must be finite"),
    ({"resolution": "wide"}, "resolution: must be a number"),
    ({"origin": [0.0, 0.0]}, "origin.2: is required"),
    ({"origin": [0.0, math.inf, 0.0]}, "origin.1: must be finite"),
    ({"negate": 7}, "negate: must be true or false"),
    ({"occupied_thresh": 1.5}, "occupied_thresh: must be less than or equal to 1 (got 1.5)"),
    ({"free_thresh": -0.1}, "free_thresh: must be greater than or equal to 0 (got -0.1)"),
    ({"free_thresh": 0.7}, "free_thresh 0.7 must not be above occupied_thresh 0.65"),
    ({"mode": "quaternary"}, "mode: must be 'trinary', 'scale' or 'raw' (got 'quaternary')"),
    ({"origin": [0.0, 0.0, math.nan]}, "origin.2: must be finite"),
]


@pytest.mark.parametrize("changes, expected", BAD_SHEETS)
def test_bad_sheets_are_refused(write, changes, expected):
    path = write(**changes)
    assert refused(path).startswith(f"{path}: {expected}")


@pytest.mark.parametrize("text", ["", "just words", "- 1\n- 2\n"])
def test_a_sheet_without_fields(tmp_path, text):
    (tmp_path / "m.yaml").write_text(text)
    assert "must hold the fields of a map_server map" in refused(tmp_path / "m.yaml")


def test_sheets_that_are_no_yaml(tmp_path):
    (tmp_path / "m.yaml").write_text("image: [unclosed")
    assert refused(tmp_path / "m.yaml").startswith(f"{tmp_path / 'm.yaml'}: is not valid YAML")
    (tmp_path / "m.yaml").write_bytes(b"\xff\xfe\x00")
    assert "cannot be read as text: it is not in UTF-8" in refused(tmp_path / "m.yaml")
    (tmp_path / "m.yaml").write_text("!!python/object/apply:os.getcwd []")
    assert "is not valid YAML" in refused(tmp_path / "m.yaml")
    assert refused(tmp_path / "n.yaml") == f"{tmp_path / 'n.yaml'}: no such file"


def test_a_picture_without_its_sheet(tmp_path):
    Image.fromarray(RAMP).save(tmp_path / "p.png")
    path = tmp_path / "p.png"
    assert refused(path) == f"{path}: is not a map: the map_server file p.yaml must be beside it"
    assert refused(tmp_path / "q.png") == f"{tmp_path / 'q.png'}: no such file"


def test_pictures_that_are_no_maps(write, tmp_path):
    path = tmp_path / "m.png"
    photo = np.random.default_rng(0).integers(0, 256, (20, 30, 3), dtype=np.uint8)
    assert refused(write(photo)) == f"{path}: must be a grey map, but this picture is in colour"
    assert refused(write(RAMP.astype(np.uint16) * 256)).startswith(f"{path}: must have 8 bits per pixel")
    assert refused(write(b"these are words, not pixels")) == f"{path}: must be a PNG or PGM picture"
    assert refused(write(b"")) == f"{path}: must be a PNG or PGM picture"
    Image.fromarray(photo).save(tmp_path / "m.jpg")
    assert refused(write(None, "m.jpg")) == f"{tmp_path / 'm.jpg'}: must be a PNG or PGM picture"
    assert refused(write(None, "none.png")) == f"{tmp_path / 'none.png'}: no such picture"


@pytest.mark.parametrize(
    "head", [b"P5 0 4 255\n", b"P5 4 0 255\n", b"P5 -4 4 255\n", b"P5 4 4 0\n", b"P5 4", b"P2 2 1 255\n7 x"]
)
def test_pgm_headers_that_lie(write, head):
    assert "m.pgm: " in refused(write(head, "m.pgm"))


@pytest.mark.parametrize("name", ["m.png", "m.pgm"])
def test_every_picture_cut_short_is_refused(write, tmp_path, name):
    write(np.random.default_rng(1).integers(0, 256, (40, 50), dtype=np.uint8), name)
    whole = (tmp_path / name).read_bytes()
    end = len(whole) - 24 if name == "m.png" else len(whole)  # a PNG ends in checksums and an empty chunk: no pixels
    for length in [0, 5, 9, *range(12, end, 181), end - 1]:
        assert str(tmp_path / name) in refused(write(whole[:length], name)), length


def test_a_picture_of_absurd_size_is_refused(write, monkeypatch):
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 4)
    assert "is damaged or cut short" in refused(write())


def test_the_map_in_the_repository():
    grid = ros_map.load(DATA / "rooms.yaml")
    assert grid.shape == (28, 40) and grid.origin_xy.tolist() == [-1.0, -0.5]
    assert (grid.classes[0] == U).all() and (grid.classes[2, 2:-2] == X).all()


@pytest.mark.parametrize("radius", [0.0, 0.02, 0.025, 0.026, 0.05, 0.074, 0.075, 0.08, 0.1, 0.25, 3.0])
def test_inflation_is_the_disc_against_each_square(radius):
    rng = np.random.default_rng(5)
    classes = rng.choice([U, F, X, int(Cell.BUMP)], (9, 13), p=[0.1, 0.7, 0.05, 0.15]).astype(np.int8)
    grid = ClassGrid(classes, np.zeros_like(classes), np.zeros(2), 0.05)
    expected = classes.copy()
    for i, j in np.ndindex(classes.shape):
        for k, m in np.argwhere(classes == X):
            gap = math.hypot(max(abs(k - i) - 0.5, 0), max(abs(m - j) - 0.5, 0)) * 0.05
            if gap < radius - 1e-9:
                expected[i, j] = X
    np.testing.assert_array_equal(inflate(grid, radius).classes, expected)


@pytest.mark.parametrize("radius", [-0.1, math.nan, math.inf])
def test_a_bad_radius_is_refused(radius):
    grid = ros_map.load(DATA / "rooms.yaml")
    with pytest.raises(InputError, match=r"radius: must be finite and 0 m or more \(got "):
        inflate(grid, radius)
