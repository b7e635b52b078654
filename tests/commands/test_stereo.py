"""`jaxbiped stereo` on the motorcycle pair, on to `plan`, and every way it refuses."""

import json
import math
import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from skimage import data

from jaxbiped import cli
from jaxbiped.commands import stereo
from jaxbiped.commands.map_source import open_map
from jaxbiped.commands.stereo import StereoArgs
from jaxbiped.config import load_toml
from jaxbiped.core import class_grid
from jaxbiped.errors import InputError
from jaxbiped.mapping.grid import Cell
from jaxbiped.mapping.scan_map import ONE_LOOK, lay_out, make_chart
from jaxbiped.motion.config import RobotConfig
from jaxbiped.stereo import Disparity, to_points
from jaxbiped.stereo.calibration_files import load_rig

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


# x ahead of the camera and y to its left [m]; read off the map of the published disparities
PLACES = {
    "before the front wheel": (2.02, -0.3),
    "front wheel": (2.15, -0.75),
    "rear wheel": (2.42, 0.4),
    "floor behind": (3.1, -1.25),
    "shelf": (3.6, -1.2),
    "behind the engine": (3.0, 0.2),
}


def test_its_map_is_that_of_the_published_disparities(mapped):
    """Our matcher against Middlebury's structured light, by one transform and on one grid."""
    truth = data.stereo_motorcycle()[2]
    known = np.isfinite(truth)
    camera = load_rig(CAMERA, (741, 500)).camera
    x, y, z, weight = to_points(Disparity(np.where(known, truth, 0), known), camera)
    T = np.array(json.loads((mapped / "stereo.json").read_text())["T_map_camera"])
    points = np.stack([x, y, z], axis=1)[weight > 0] @ T[:3, :3].T + T[:3, 3]
    ours = class_grid.load(mapped / "classes.npz")
    spec, origin = lay_out(points, 0.05, area=ours.extent)
    theirs = make_chart(points, spec, origin, RobotConfig().body(), ONE_LOOK).grid
    both = (ours.classes != Cell.UNMEASURED) & (theirs.classes != Cell.UNMEASURED)
    assert both.sum() > 0.75 * (ours.classes != Cell.UNMEASURED).sum()
    assert (ours.classes == theirs.classes)[both].mean() > 0.9
    for name, xy in PLACES.items():
        assert ours.classes[ours.cell_at(xy)] == theirs.classes[theirs.cell_at(xy)], name


def test_plan_takes_its_map(mapped):
    source = open_map(mapped / "classes.npz", pitch=0.05, radius=0.0)
    assert source.kind == "class grid" and source.free_cell((2.0, 0.3), "start") == source.grid.cell_at((2.0, 0.3))


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


def with_changes(tmp_path, **changes):
    """The motorcycle's camera file with other values."""
    values = load_toml(CAMERA) | changes
    lines = [f"{key} = {value}" for key, value in values.items() if not isinstance(value, dict) and value is not None]
    tables = [
        f"[{key}]\n" + "\n".join(f"{k} = {v}" for k, v in value.items())
        for key, value in values.items()
        if isinstance(value, dict)
    ]
    path = tmp_path / "camera.toml"
    path.write_text("\n".join(lines + tables) + "\n")
    return path


def test_a_pose_in_the_camera_file(pair, tmp_path, capsys):
    """One that the floor agrees with is refined by it; the floor is believed no more than 5 degrees off it."""
    camera = with_changes(tmp_path, pose={"pitch": 17.0, "height": 1.0})
    assert run(tmp_path, *pair, camera) == 0
    assert "floor     found: camera 1.08" in capsys.readouterr().out
    camera = with_changes(tmp_path, pose={"pitch": 30.0, "height": 1.0})
    assert run(tmp_path, *pair, camera, out=tmp_path / "other") == 0
    said = json.loads((tmp_path / "other" / "stereo.json").read_text())
    assert (said["pitch_degrees"], said["height"]) == (pytest.approx(30), 1.0) and not said["floor_found"]
    assert "pose      from the camera file, as no floor was found" in capsys.readouterr().out


def cropped(pair, tmp_path, rows):
    """Some rows of the pair alone."""
    paths = []
    for path in pair:
        paths.append(tmp_path / path.name)
        with Image.open(path) as image:
            image.crop((0, rows.start, image.width, rows.stop)).save(paths[-1])
    return paths


def test_few_matches_and_a_leaning_floor_are_warned_of(capsys):
    """One line each, on stderr."""
    stereo.warn(0.2, math.radians(20))
    assert capsys.readouterr() == ("", "")
    stereo.warn(0.199, math.radians(-20.1))
    first, second = capsys.readouterr().err.splitlines()
    assert first.startswith("jaxbiped: warning: only 19.9% of the pixels match, below 20%: the map may be unreliable")
    assert second.startswith(
        "jaxbiped: warning: the floor that was found is rolled by -20 degrees, above 20: it may be"
    )


def test_the_command_warns_of_a_picture_that_is_mostly_plain(pair, tmp_path, capsys):
    """The motorcycle pair with all but a fifth of its rows painted over, turned by nothing."""
    paths = []
    for path in pair:
        with Image.open(path) as image:
            pixels = np.asarray(image).copy()
        pixels[:410] = 90
        paths.append(tmp_path / path.name)
        Image.fromarray(pixels).save(paths[-1])
    camera = with_changes(tmp_path, pose={"pitch": 15.0, "height": 1.08})
    assert run(tmp_path, *paths, camera) == 0
    captured = capsys.readouterr()
    share = float(captured.out.partition("matched   ")[2].partition("%")[0])
    assert 5 < share < 20
    assert captured.err.count("\n") == 1 and f"warning: only {share}% of the pixels match" in captured.err


def test_no_floor_in_view(pair, tmp_path):
    """The upper third of the picture: wall, shelves and handlebars."""
    paths = cropped(pair, tmp_path, slice(0, 160))
    text = refused(tmp_path, *paths, with_changes(tmp_path, height=160))
    assert text.startswith(f"{paths[0]}: shows no detectable floor; give pitch and height of the camera")


def test_grey_and_16_bit_pictures_give_the_same_map(mapped, pair, tmp_path):
    paths = []
    for path in pair:
        paths.append(tmp_path / path.name)
        with Image.open(path) as image:
            Image.fromarray(np.asarray(image.convert("L")).astype(np.uint16) * 257).save(paths[-1])
    assert run(tmp_path, *paths) == 0
    deep, colour = (class_grid.load(folder / "classes.npz") for folder in (tmp_path / "out", mapped))
    x0, y0 = np.maximum(deep.origin_xy, colour.origin_xy)
    same = []
    for x in np.arange(x0 + 0.025, 4.0, 0.05):
        for y in np.arange(y0 + 0.025, 1.0, 0.05):
            same.append(deep.classes[deep.cell_at((x, y))] == colour.classes[colour.cell_at((x, y))])
    assert np.mean(same) > 0.97


def test_what_is_refused(pair, tmp_path):
    left, right = pair
    small, _ = cropped(pair, tmp_path, slice(0, 400))
    assert "right: must have the size of the left picture, 741 x 400" in refused(tmp_path, small, right)
    assert "left: must be 741 x 500 px, as the camera file says" in refused(tmp_path, small, small)
    assert "left and right look swapped" in refused(tmp_path, right, left)
    assert "camera: no such file" in refused(tmp_path, left, right, tmp_path / "none.toml")
    assert "no such file" in refused(tmp_path, tmp_path / "none.png", right)
    absurd = with_changes(tmp_path, baseline=193.001)
    assert "baseline: " in refused(tmp_path, left, right, absurd)
    Image.new("L", (741, 500)).save(tmp_path / "black.png")
    assert "is blank: every pixel is 0" in refused(tmp_path, left, tmp_path / "black.png")
    (tmp_path / "cut.png").write_bytes(left.read_bytes()[:9000])
    assert "is not a picture, or is damaged" in refused(tmp_path, tmp_path / "cut.png", right)
    assert "must show something within 0.5 m" in refused(tmp_path, left, right, max_range=0.5)
    assert "right: must have" not in refused(tmp_path, left, left)  # one picture twice matches at 0 px, infinitely far
    (tmp_path / "out").mkdir()
    assert refused(tmp_path, left, right).startswith("out: must be a folder that does not exist yet")
