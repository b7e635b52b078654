"""`jaxbiped classify --heightmap`: stairs of known classes from every kind of file, and every way it refuses."""

import json
import os

import numpy as np
import pytest
from PIL import Image

from jaxbiped import cli
from jaxbiped.core import class_grid
from jaxbiped.formats import load_elevation
from jaxbiped.mapping.grid import Cell

F, B, X, U = Cell.FLOOR, Cell.BUMP, Cell.OBSTACLE, Cell.UNMEASURED
# As the real case: 8 bits, RGBA, 0 to 255 is 0 to 1.25 m, 4 cm a pixel, to be brought to a quarter. Steps of 12 cm are
# then such of 3 cm, and treads of 1 m such of 25 cm. The last tread is a landing; a wall of 1.2 m stands beside it.
TREADS = 100  # pixels of 4 cm, upward along x: 25 a tread
STEP = 0.12 / 1.25 * 255  # grey levels; rounding to whole ones is 2.5 mm, and 0.6 mm at a quarter


def stairs(rows=61):
    tread = np.arange(TREADS + 1) // 25
    grey = np.round(np.minimum(tread, 3) * STEP)
    image = np.tile(grey, (rows, 1))
    image[:25] = 255  # a wall along the upper side, 1 m wide
    grey = image.astype(np.uint8)
    return np.dstack([grey, grey, grey, np.full_like(grey, 255)])


# By hand, at a quarter: 100 x 60 cm, cells of 5 cm. The wall covers y from 35 cm on, and the body's radius of 10 cm
# below it is obstacle, too. Treads begin at 25, 50 and 75 cm. No step is higher than the robot's.
CLASSES = np.array([[F] * 5 + [B] * 15] * 5 + [[X] * 20] * 7)
LEVELS = np.array([0] * 5 + [1] * 5 + [2] * 5 + [3] * 5)


def saved(folder, image=None):
    path = folder / "stairs.png"
    Image.fromarray(stairs() if image is None else image).save(path)
    return path


def run(tmp_path, path, *options):
    words = ["classify", str(path), "--heightmap", *options, "--out", str(tmp_path / "out")]
    assert cli.main(words) == 0
    return class_grid.load(tmp_path / "out" / "classes.npz")


PICTURE = ("--cell", "0.04", "--range", "0", "1.25")


def test_stairs_are_what_they_are(tmp_path, capsys):
    grid = run(tmp_path, saved(tmp_path), *PICTURE, "--scale", "0.25")
    np.testing.assert_array_equal(grid.classes, CLASSES)
    np.testing.assert_array_equal(grid.levels[:5], np.tile(LEVELS, (5, 1)))
    assert grid.pitch == 0.05 and grid.origin_xy.tolist() == [0, 0]
    said = capsys.readouterr().out
    assert (
        "101 x 61, 1 x 0.6 m, 0.000 to 0.312 m" in said
        and "floor     found: 0.000 m; a level is a step, 0.03 m" in said
    )
    assert "20 x 12 cells of 0.05 m (25 floor, 75 bump, 140 obstacle)" in said and "walls " not in said
    files = ["classes.npz", "classify.json", "elevation.npz", "elevation.png", "map.png"]
    assert sorted(os.listdir(tmp_path / "out")) == files
    facts = json.loads((tmp_path / "out" / "classify.json").read_text())
    assert facts["floor_found"] and facts["floor"] == 0 and facts["holes"] == 0 and facts["heights"] == [61, 101]


def test_the_written_elevation_gives_the_same_again(tmp_path):
    first = run(tmp_path, saved(tmp_path), *PICTURE, "--scale", "0.25")
    (tmp_path / "out").rename(tmp_path / "first")
    again = run(tmp_path, tmp_path / "first" / "elevation.npz")
    np.testing.assert_array_equal(again.classes, first.classes)
    np.testing.assert_array_equal(again.levels, first.levels)


def test_holes_are_unmeasured(tmp_path):
    image = stairs()
    image[50:, 10:30, 3] = 0
    grid = run(tmp_path, saved(tmp_path, image), *PICTURE, "--scale", "0.25")
    expected = CLASSES.copy()
    expected[:2, 2:6] = U  # y from 0 to 10 cm, x from 10 to 30 cm; a triangle more on each side is 1 cm
    np.testing.assert_array_equal(grid.classes, expected)


def test_the_floor_is_found_and_given(tmp_path, capsys):
    """Of a map above the sea, with a few pits that are errors; and one tread higher, where lower ones are too deep."""
    heights = np.tile(431.7 + 0.03 * (np.arange(101) // 25), (41, 1))
    heights[3, 3:6] -= 0.02
    np.savez(tmp_path / "a.npz", heights=heights, pitch=0.01, origin_xy=[5e5, 4e6])
    grid = run(tmp_path, tmp_path / "a.npz")
    assert "found: 431.700 m" in capsys.readouterr().out
    assert grid.origin_xy.tolist() == [5e5, 4e6]
    np.testing.assert_array_equal(grid.levels[4], LEVELS)
    (tmp_path / "out").rename(tmp_path / "first")
    grid = run(tmp_path, tmp_path / "a.npz", "--floor", "431.73")
    np.testing.assert_array_equal(grid.classes[4], [X] * 5 + [F] * 5 + [B] * 10)


def test_an_area_is_cut_out(tmp_path):
    grid = run(tmp_path, saved(tmp_path), *PICTURE, "--scale", "0.25", "--area", "0.25", "1.1", "0", "0.2")
    expected = np.full((4, 17), B)
    expected[:, :5], expected[:, 15:] = B, U
    np.testing.assert_array_equal(grid.classes, expected)
    assert grid.origin_xy.tolist() == [0.25, 0]


def test_what_is_too_high_to_stand_on_is_said_to_be_walls(tmp_path, capsys):
    grid = run(tmp_path, saved(tmp_path), *PICTURE)
    assert (
        "walls     41.0% of the heights lie more than 0.705 m above the floor, and count as walls"
        in capsys.readouterr().out
    )
    assert (grid.classes[-10:] == X).all()


def test_goes_on_to_plan(tmp_path):
    run(tmp_path, saved(tmp_path), *PICTURE, "--scale", "0.25")
    words = ["plan", str(tmp_path / "out" / "classes.npz"), "--start", "0.1", "0.1", "--goal", "0.9", "0.1"]
    assert cli.main([*words, "--out", str(tmp_path / "plan")]) == 0


@pytest.mark.parametrize(
    "options, said",
    [
        (("--cell", "0.04"), "range: is required: heights LOW and HIGH [m] of the values 0 and 255"),
        (("--range", "0", "1"), "cell: is required for a picture"),
        (("--cell", "0", "--range", "0", "1"), "--cell: "),
        (("--cell", "0.04", "--range", "1", "0"), "range: must be LOW and HIGH [m], LOW below HIGH"),
        ((*PICTURE, "--scale", "0"), "--scale: "),
        ((*PICTURE, "--up", "0", "0", "1"), "up: goes with clouds only"),
        ((*PICTURE, "--tilt", "3"), "tilt: goes with clouds only"),
        ((*PICTURE, "--map.voxel", "3"), "map: goes with clouds only"),
        ((*PICTURE, "--area", "1", "0", "0", "1"), "area: must be X0 < X1 and Y0 < Y1"),
        (
            (*PICTURE, "--scale", "1000"),
            "pitch: must give at most 4,000,000 cells on 4000 x 2400 m; choose a larger --pitch",
        ),
    ],
)
def test_refusals_are_one_line_and_leave_nothing(tmp_path, capsys, options, said):
    path = saved(tmp_path)
    words = ["classify", str(path), "--heightmap", *options, "--out", str(tmp_path / "out")]
    assert cli.main(words) == 2
    text = capsys.readouterr().err
    assert text.count("\n") == 1 and said in text, text
    assert os.listdir(tmp_path) == ["stairs.png"]


@pytest.mark.parametrize("option", [("--cell", "0.1"), ("--range", "0", "1"), ("--hole", "3")])
def test_options_of_elevation_maps_do_not_go_with_clouds(tmp_path, capsys, option):
    np.savez(tmp_path / "a.npz", points=np.random.default_rng(0).random((50, 3)))
    assert cli.main(["classify", str(tmp_path / "a.npz"), *option]) == 2
    assert "goes with --heightmap only" in capsys.readouterr().err


def test_a_cloud_is_no_elevation_map(tmp_path, capsys):
    np.savez(tmp_path / "a.npz", points=np.random.default_rng(0).random((50, 3)))
    assert cli.main(["classify", str(tmp_path / "a.npz"), "--heightmap", "--out", str(tmp_path / "out")]) == 2
    assert "heights: is missing; an elevation map holds heights, pitch, origin_xy" in capsys.readouterr().err


def test_elevation_is_what_was_read(tmp_path):
    path = saved(tmp_path)
    run(tmp_path, path, *PICTURE, "--scale", "0.5")
    found = load_elevation(tmp_path / "out" / "elevation.npz")
    np.testing.assert_array_equal(found.heights, load_elevation(path, cell=0.04, range=(0.0, 1.25), scale=0.5).heights)
