"""Moving AI maps and scenarios: every character, the row order, and every way a file can be cut or wrong."""

from pathlib import Path

import numpy as np
import pytest

from jaxbiped.errors import InputError
from jaxbiped.formats import moving_ai
from jaxbiped.mapping.grid import Cell

DATA = Path(__file__).parent.parent / "data"
MAP = "type octile\nheight 2\nwidth 7\nmap\n.GS@OTW\n.......\n"
SCEN = "version 1\n3\tm.map\t7\t2\t1\t0\t6\t1\t5.41421356\n"


@pytest.fixture
def write(tmp_path):
    def write(text, name="a.map"):
        path = tmp_path / name
        path.write_bytes(text.encode("latin-1") if isinstance(text, str) else text)
        return path

    return write


def refused(call, *args):
    with pytest.raises(InputError) as caught:
        call(*args)
    return str(caught.value)


def test_characters_rows_and_columns(write):
    grid = moving_ai.load_map(write(MAP))
    F, X = Cell.FLOOR, Cell.OBSTACLE
    np.testing.assert_array_equal(grid.classes, [[F, F, F, X, X, X, X], [F] * 7])
    assert (grid.levels == 0).all() and grid.pitch == 0.05 and (grid.origin_xy == 0).all()
    assert moving_ai.load_map(write(MAP), 1.0).pitch == 1.0


def test_windows_line_ends_and_trailing_empty_lines_are_fine(write):
    expected = moving_ai.load_map(write(MAP)).classes
    np.testing.assert_array_equal(moving_ai.load_map(write(MAP.replace("\n", "\r\n") + "\r\n\n")).classes, expected)
    np.testing.assert_array_equal(moving_ai.load_map(write(MAP.rstrip())).classes, expected)


BAD_MAPS = [
    ("", ": must be a Moving AI map, whose first line is 'type octile' (got '')"),
    (MAP.replace("octile", "tile"), ": type: must be octile: maps of other types are not supported (got 'tile')"),
    (b"\x89PNG\r\n\x1a\n\0\0\0", ": must be a Moving AI map"),
    (MAP.replace("height 2\n", ""), ": height: must be a whole number of cells from 1 to 65536 (got '')"),
    (MAP.replace("height 2", "height 0"), ": height: must be a whole number of cells from 1 to 65536 (got '0')"),
    (MAP.replace("height 2", "height -2"), ": height: must be a whole number of cells from 1 to 65536 (got '-2')"),
    (MAP.replace("width 7", "width 7e9"), ": width: must be a whole number of cells from 1 to 65536 (got '7e9')"),
    (MAP.replace("width 7", "width 99999999999"), ": width: must be a whole number"),
    (MAP.replace("map\n", ""), ": line 4: must be the word 'map' (got '.GS@OTW')"),
    ("type octile\nheight 2\nwidth 7\n", ": line 4: must be the word 'map' (got '')"),
    ("type octile\nheight 2\nwidth 7\nmap\n", ": map: must hold 2 rows, as its header says (got 0)"),
    (MAP[:-9], ": map: must hold 2 rows, as its header says (got 1)"),
    (MAP[:-3], ": line 6: must be 7 characters long, as the header says (got 5)"),
    (MAP + ".......\n", ": map: must hold 2 rows, as its header says (got 3)"),
    (MAP.replace("GS", "G?"), ": line 5, column 3: must be one of . G S @ O T W (got '?')"),
    (MAP.replace("GS", "G\xe9"), ": line 5, column 3: must be one of . G S @ O T W (got 'é')"),
]


@pytest.mark.parametrize("text, expected", BAD_MAPS)
def test_bad_maps_are_refused(write, text, expected):
    path = write(text)
    assert refused(moving_ai.load_map, path).startswith(f"{path}{expected}")


@pytest.mark.parametrize("pitch", [0.0, -1.0, float("nan"), float("inf")])
def test_bad_pitch_is_refused(write, pitch):
    assert refused(moving_ai.load_map, write(MAP), pitch).startswith("pitch: must be finite and above 0 m")


def test_missing_file_and_folder(tmp_path):
    assert refused(moving_ai.load_map, tmp_path / "no.map") == f"{tmp_path / 'no.map'}: no such file"
    assert refused(moving_ai.load_map, tmp_path) == f"{tmp_path}: cannot be read: is a directory"


def test_scenario_swaps_x_y_to_row_column(write):
    grid = moving_ai.load_map(write(MAP))
    for text in (SCEN, SCEN.replace("\t", " "), SCEN.replace("version 1", "version 1.0") + "\n\n"):
        scenario = moving_ai.load_scenario(write(text, "a.scen"), grid)
        assert scenario.bucket.tolist() == [3]
        assert scenario.start_ij.tolist() == [[0, 1]] and scenario.goal_ij.tolist() == [[1, 6]]
        assert scenario.optimal.tolist() == [5.41421356]


def test_tolerance_follows_the_digits_of_the_file():
    def of(*texts):
        return moving_ai.rounding(np.array([float(text) for text in texts]), texts)

    np.testing.assert_allclose(of("4", "5.41421", "188.51"), [5e-6, 5e-6, 5e-4], rtol=1e-2)  # 6 significant digits
    np.testing.assert_allclose(of("2.00", "188.51", "1244.95"), [5e-3] * 3, rtol=1e-2)  # 2 decimals
    np.testing.assert_allclose(of("1.00000000", "3201.44696807"), [6e-9, 3.2e-6], rtol=1e-1)  # 8, and sums of floats
    np.testing.assert_allclose(of("4787", "11"), [5e-3, 5e-5], rtol=1e-2)  # whole numbers of 6 digits


def test_a_byte_order_mark_is_no_content(write):
    expected = moving_ai.load_map(write(MAP)).classes
    grid = moving_ai.load_map(write(b"\xef\xbb\xbf" + MAP.encode()))
    np.testing.assert_array_equal(grid.classes, expected)
    found = moving_ai.load_scenario(write(b"\xef\xbb\xbf" + SCEN.encode(), "a.scen"), grid)
    assert found.goal_ij.tolist() == [[1, 6]]


@pytest.mark.parametrize("head", ["height 2\nwidth 7\n", "type octile\n\nwidth 7\nheight 2\nmade by hand\n"])
def test_the_header_in_any_order_and_without_its_type(write, head):
    expected = moving_ai.load_map(write(MAP)).classes
    np.testing.assert_array_equal(moving_ai.load_map(write(MAP.replace(MAP[:28], head))).classes, expected)


@pytest.mark.parametrize("name", ["Å.map", "a\u2028b\u0085c\x0bd.map", "two words.map"])
@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_lines_of_a_scenario_end_at_line_feeds_alone(write, name, encoding):
    """A map's name may hold anything else, such as the second byte of a letter in UTF-8, or U+2028."""
    grid = moving_ai.load_map(write(MAP))
    text = (SCEN + SCEN.splitlines()[1].replace("5.41421356", "6.0") + "\n").replace("m.map", name)
    scenario = moving_ai.load_scenario(write(text.encode(encoding, "replace"), "a.scen"), grid)
    assert scenario.optimal.tolist() == [5.41421356, 6.0]


def test_scenarios_without_a_version(write):
    """Version 0: no line that says so, and perhaps no size of the map."""
    grid = moving_ai.load_map(write(MAP))
    for query in (SCEN[10:], SCEN[10:].replace("\t7\t2", "")):
        scenario = moving_ai.load_scenario(write(query, "a.scen"), grid)
        assert scenario.start_ij.tolist() == [[0, 1]] and scenario.goal_ij.tolist() == [[1, 6]]


BAD_SCENARIOS = [
    ("", ": must hold at least one query"),
    ("words, no query\n", ": line 1: must hold bucket, map, width, height, start x"),
    (SCEN.replace("version 1", "version 2"), ": line 1: must begin with 'version 1' (got 'version 2')"),
    ("version 1\n", ": must hold at least one query"),
    (SCEN[:-13], ": line 2: must hold bucket, map, width, height, start x, start y, goal x, goal y, optimal length"),
    (SCEN.replace("5.41421356", "long"), ": line 2: must hold bucket, map"),
    (
        SCEN.replace("\t7\t2\t", "\t8\t2\t"),
        ": line 2: must be for a map of the size of this one, 7 x 2 (got '8 x 2')",
    ),
    (SCEN.replace("\t6\t1\t", "\t7\t1\t"), ": line 2: position must lie on the map, 7 x 2 (got (7, 1))"),
    (SCEN.replace("\t1\t0\t", "\t1\t-1\t"), ": line 2: position must lie on the map, 7 x 2 (got (1, -1))"),
    (SCEN.replace("5.41421356", "nan"), ": line 2: optimal length must be finite and 0 or more (got nan)"),
    (SCEN.replace("5.41421356", "-1"), ": line 2: optimal length must be finite and 0 or more (got -1.0)"),
    (SCEN.replace("5.41421356", "inf"), ": line 2: optimal length must be finite and 0 or more (got inf)"),
]


@pytest.mark.parametrize("text, expected", BAD_SCENARIOS)
def test_bad_scenarios_are_refused(write, text, expected):
    grid = moving_ai.load_map(write(MAP))
    path = write(text, "a.scen")
    assert refused(moving_ai.load_scenario, path, grid).startswith(f"{path}{expected}")


def test_the_map_in_the_repository(write):
    grid = moving_ai.load_map(DATA / "rooms.map")
    scenario = moving_ai.load_scenario(DATA / "rooms.map.scen", grid)
    assert grid.shape == (24, 36) and len(scenario.optimal) == 40
    for cells in (scenario.start_ij, scenario.goal_ij):
        assert (grid.classes[tuple(cells.T)] == Cell.FLOOR).all()
