"""The class grid file: what is written is read back, and nothing else is taken for one."""

import errno
import os

import numpy as np
import pytest

from jaxbiped import files
from jaxbiped.core import class_grid
from jaxbiped.core.class_grid import ClassGrid
from jaxbiped.errors import InputError


def fields(**changes):
    whole = {
        "classes": np.array([[0, 1, 2], [3, 4, 1]], np.int8),
        "levels": np.array([[0, 0, 1], [0, 0, -1]], np.int8),
        "origin_xy": np.array([-0.5, 2.0]),
        "pitch": 0.05,
    }
    return {key: value for key, value in (whole | changes).items() if value is not None}


@pytest.fixture
def grid():
    return ClassGrid(**fields())


def message(call, *args, **kwargs):
    with pytest.raises(InputError) as caught:
        call(*args, **kwargs)
    return str(caught.value)


def test_what_is_saved_is_loaded(grid, tmp_path):
    class_grid.save(grid, tmp_path / "a.npz")
    again = class_grid.load(tmp_path / "a.npz")
    for key in class_grid.KEYS:
        np.testing.assert_array_equal(getattr(again, key), getattr(grid, key))
    assert again.classes.dtype == again.levels.dtype == np.int8
    assert os.listdir(tmp_path) == ["a.npz"]


def test_the_file_is_the_one_of_the_design(grid, tmp_path):
    class_grid.save(grid, tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as archive:
        assert sorted(archive.files) == ["classes", "levels", "origin_xy", "pitch"]
        assert archive["classes"].dtype == archive["levels"].dtype == np.int8
        assert archive["origin_xy"].shape == (2,) and archive["pitch"].shape == ()


def test_cells_and_points_agree(grid):
    cells = np.argwhere(np.ones(grid.shape, bool))
    centres = grid.centres_xy(cells)
    assert [grid.cell_at(tuple(xy)) for xy in centres] == [tuple(ij) for ij in cells]
    assert grid.cell_at((-0.5, 2.0)) == (0, 0)
    np.testing.assert_allclose(grid.extent, (-0.5, -0.35, 2.0, 2.1))


@pytest.mark.parametrize("xy", [(-0.51, 2.05), (-0.35, 2.05), (-0.4, 2.1), (np.nan, 2.05), (0.0, np.inf)])
def test_a_point_outside_the_map_is_refused(grid, xy):
    text = message(grid.cell_at, xy, "start")
    assert text.startswith("start: must lie on the map, x in [-0.5, -0.35) m and y in [2, 2.1) m (got (")


BAD_FIELDS = [
    ({"pitch": None}, "pitch: is missing; a class grid holds classes, levels, origin_xy, pitch"),
    ({"levels": None}, "levels: is missing"),
    ({"extra": np.zeros(2)}, "extra: unknown key; a class grid holds"),
    ({"pitch": 0.0}, "pitch: must be finite and above 0 m (got 0.0)"),
    ({"pitch": -1.0}, "pitch: must be finite and above 0 m (got -1.0)"),
    ({"pitch": np.nan}, "pitch: must be finite and above 0 m (got nan)"),
    ({"pitch": np.zeros(2)}, "pitch: must be one number [m]"),
    ({"pitch": "wide"}, "pitch: must be one number [m]"),
    ({"origin_xy": np.zeros(3)}, "origin_xy: must be two finite numbers x, y [m] (got [0.0, 0.0, 0.0])"),
    ({"origin_xy": np.array([0, np.inf])}, "origin_xy: must be two finite numbers"),
    ({"classes": np.zeros(6, np.int8)}, "classes: must be an array [H, W] with at least one cell (got 'int8 [6]')"),
    ({"classes": np.zeros((0, 3), np.int8)}, "classes: must be an array [H, W] with at least one cell"),
    ({"classes": np.zeros((2, 3), np.int64)}, "classes: must be of type int8 (got 'int64 [2, 3]')"),
    ({"levels": np.zeros((2, 3))}, "levels: must be of type int8 (got 'float64 [2, 3]')"),
    ({"levels": np.zeros((3, 2), np.int8)}, "levels: must have the shape of classes, (2, 3) (got (3, 2))"),
    (
        {"classes": np.full((2, 3), 5, np.int8)},
        "classes[0, 0]: must be one of 0 unmeasured, 1 floor, 2 bump, 3 gate, 4",
    ),
    ({"classes": np.array([[1, 1, 1], [1, -1, 1]], np.int8)}, "classes[1, 1]: must be one of 0 unmeasured"),
]


@pytest.mark.parametrize("changes, text", BAD_FIELDS)
def test_bad_fields_are_named(changes, text, tmp_path):
    path = tmp_path / "bad.npz"
    np.savez(path, **fields(**changes))
    assert message(class_grid.load, path).startswith(f"{path}: {text}")


def test_a_grid_made_by_hand_is_checked_too():
    assert message(ClassGrid, **fields(pitch=-1.0)) == "pitch: must be finite and above 0 m (got -1.0)"


def test_every_file_cut_short_is_refused(grid, tmp_path):
    class_grid.save(grid, tmp_path / "a.npz")
    whole = (tmp_path / "a.npz").read_bytes()
    for length in [0, 1, 10, *range(20, len(whole), 37), len(whole) - 1]:
        path = tmp_path / "cut.npz"
        path.write_bytes(whole[:length])
        assert str(path) in message(class_grid.load, path), length


def test_damage_inside_is_refused(grid, tmp_path):
    class_grid.save(grid, tmp_path / "a.npz")
    whole = bytearray((tmp_path / "a.npz").read_bytes())
    place = whole.index(b"classes.npy") + 40
    whole[place : place + 8] = b"\xff" * 8
    (tmp_path / "b.npz").write_bytes(whole)
    assert "b.npz" in message(class_grid.load, tmp_path / "b.npz")


def test_other_files_are_refused(tmp_path):
    np.save(tmp_path / "array.npy", np.zeros(3))
    assert message(class_grid.load, tmp_path / "array.npy").endswith("must be an .npz class grid, not a single array")
    (tmp_path / "text.npz").write_text("not a grid at all")
    assert "is no .npz class grid" in message(class_grid.load, tmp_path / "text.npz") or "pickled" in message(
        class_grid.load, tmp_path / "text.npz"
    )
    assert message(class_grid.load, tmp_path / "none.npz") == f"{tmp_path / 'none.npz'}: no such file"
    assert message(class_grid.load, tmp_path) == f"{tmp_path}: cannot be read: is a directory"


def test_pickled_objects_are_never_unpickled(tmp_path):
    class Trap:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "sprung"),)

    np.savez(tmp_path / "trap.npz", **fields(classes=np.array([Trap()], object)))
    assert message(class_grid.load, tmp_path / "trap.npz").endswith("holds pickled objects, which are refused")
    assert not (tmp_path / "sprung").exists()


def test_a_full_disk_leaves_the_old_file(grid, tmp_path, monkeypatch):
    path = tmp_path / "a.npz"
    class_grid.save(grid, path)
    before = path.read_bytes()

    def full(file, **arrays):
        file.write(b"half a gr")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(np, "savez_compressed", full)
    assert message(class_grid.save, grid, path) == f"{path}: cannot be written: no space left on device"
    assert path.read_bytes() == before and os.listdir(tmp_path) == ["a.npz"]


def test_a_folder_that_is_missing_is_named(grid, tmp_path):
    path = tmp_path / "none" / "a.npz"
    assert message(class_grid.save, grid, path) == f"{path}: cannot be written: no such file or directory"


def test_new_folder_is_whole_or_not_there(tmp_path):
    with files.new_folder(tmp_path / "results" / "a") as folder:
        (folder / "x.txt").write_text("x")
        assert not (tmp_path / "results" / "a").exists()
    assert os.listdir(tmp_path / "results") == ["a"] and os.listdir(tmp_path / "results" / "a") == ["x.txt"]
    with pytest.raises(InputError, match=r"out: must be a folder that does not exist yet \(got '.*a'\)"):
        files.new_folder(tmp_path / "results" / "a").__enter__()
    with pytest.raises(KeyboardInterrupt), files.new_folder(tmp_path / "results" / "b") as folder:
        (folder / "x.txt").write_text("x")
        raise KeyboardInterrupt
    assert os.listdir(tmp_path / "results") == ["a"]


def test_new_folder_under_a_file_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"), files.new_folder(tmp_path / "file" / "a"):
        pass
