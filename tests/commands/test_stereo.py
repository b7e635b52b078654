"""`jaxbiped stereo` on the motorcycle pair, on to `plan`, and every way it refuses."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from skimage import data

from jaxbiped import cli
from jaxbiped.commands import stereo
from jaxbiped.commands.stereo import StereoArgs
from jaxbiped.errors import InputError
from jaxbiped.mapping import class_grid
from jaxbiped.mapping.grid import Cell

CAMERA = Path(__file__).parents[2] / "configs" / "cameras" / "motorcycle.toml"


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """The motorcycle pair as files."""
    folder = tmp_path_factory.mktemp("pair")
    for name, image in zip(("left", "right"), data.stereo_motorcycle(), strict=False):
        Image.fromarray(image).save(folder / f"{name}.png")
    return folder / "left.png", folder / "right.png"


def run(tmp_path, left, right, camera=CAMERA, **options):
    return stereo.main(StereoArgs(left=left, right=right, camera=camera, **{"out": tmp_path / "out"} | options))


def refused(tmp_path, left, right, camera=CAMERA, **options):
    """The message; nothing may be left behind."""
    before = sorted(os.listdir(tmp_path))
    with pytest.raises(InputError) as caught:
        run(tmp_path, left, right, camera, **options)
    assert sorted(os.listdir(tmp_path)) == before
    return str(caught.value)


@pytest.fixture(scope="module")
def mapped(pair, tmp_path_factory):
    """The results folder of the motorcycle pair."""
    folder = tmp_path_factory.mktemp("mapped")
    assert run(folder, *pair) == 0
    return folder / "out"


def test_the_motorcycle_becomes_a_map(mapped):
    files = ["classes.npz", "disparity.png", "map.png", "points.ply", "stereo.json", "voxels.npz", "voxels.png"]
    assert sorted(os.listdir(mapped)) == files
    said = json.loads((mapped / "stereo.json").read_text())
    assert said["floor_found"] and said["measured"] > 0.88
    # The same plane fitted to the measured disparities of Middlebury: 1.080 m and 14.93 degrees.
    assert said["height"] == pytest.approx(1.08, abs=0.02) and said["pitch_degrees"] == pytest.approx(14.93, abs=0.4)
    grid = class_grid.load(mapped / "classes.npz")
    classes = {name: grid.classes[grid.cell_at(xy)] for name, xy in PLACES.items()}
    assert classes == {
        "before the front wheel": Cell.FLOOR,
        "front wheel": Cell.OBSTACLE,
        "rear wheel": Cell.OBSTACLE,
        "floor behind": Cell.FLOOR,
        "shelf": Cell.OBSTACLE,
        "behind the engine": Cell.UNMEASURED,
    }
    points = trimesh.load(mapped / "points.ply")
    assert len(points.vertices) > 300_000 and points.colors.shape == (len(points.vertices), 4)
    floor = points.vertices[np.abs(points.vertices[:, 2]) < 0.03]
    assert len(floor) > 50_000 and abs(floor[:, 2].mean()) < 0.003
    with np.load(mapped / "voxels.npz") as voxels:
        assert voxels["surface_cm2"].shape[:2] == grid.shape and voxels["pitch"] == 0.05
    for name in ("disparity.png", "map.png", "voxels.png"):
        with Image.open(mapped / name) as picture:
            assert min(picture.size) > 400


# x ahead of the camera and y to its left [m], measured in the point cloud of the published disparities
PLACES = {
    "before the front wheel": (2.02, -0.3),
    "front wheel": (2.15, -0.75),
    "rear wheel": (2.42, 0.4),
    "floor behind": (3.1, -1.25),
    "shelf": (3.6, -1.2),
    "behind the engine": (3.0, 0.2),
}


def test_its_map_can_be_planned_on(mapped, tmp_path, capsys):
    words = [str(mapped / "classes.npz"), "--start", "2", "0.3", "--goal", "3.2", "-1.3", "--out", str(tmp_path / "p")]
    assert cli.main(["plan", *words]) == 0
    assert "cost" in capsys.readouterr().out and (tmp_path / "p" / "path.csv").is_file()


def test_the_command_line(pair, tmp_path, capsys):
    words = [*map(str, pair), "--camera", str(CAMERA), "--pitch", "0.1", "--max-range", "4", "--out"]
    assert cli.main(["stereo", *words, str(tmp_path / "o")]) == 0
    text = capsys.readouterr().out
    assert "matched   88." in text and "floor     found: camera 1.08" in text
    assert text.splitlines()[-1].startswith(f"written   {tmp_path / 'o'}: points.ply, disparity.png, classes.npz")
    assert class_grid.load(tmp_path / "o" / "classes.npz").pitch == 0.1
    assert cli.main(["stereo", *map(str, pair[::-1]), "--camera", str(CAMERA), "--out", str(tmp_path / "p")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "left and right look swapped" in error
