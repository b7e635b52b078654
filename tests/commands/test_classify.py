"""`jaxbiped classify` on clouds of known boxes, on to `plan`, and every way it refuses."""

import json
import os
import re
import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxbiped import cli
from jaxbiped.commands import classify
from jaxbiped.commands.classify import ClassifyArgs
from jaxbiped.core import class_grid
from jaxbiped.errors import InputError
from jaxbiped.formats.cloud import save_ply
from jaxbiped.mapping.gravity import FRAMES
from jaxbiped.mapping.grid import Cell

# What stands at a few places of `room`, metres
PLACES = {(0.3, 0.3): Cell.FLOOR, (0.9, 0.8): Cell.BUMP, (1.5, 0.5): Cell.OBSTACLE, (1.475, 1.2): Cell.GATE}


def faces(rng, spacing):
    """A function that samples points [n, 3] of an upright or level rectangle from `low` to `high`."""

    def face(low, high):
        low, high = np.array(low, float), np.array(high, float)
        flat = np.argmin(high - low)
        area = np.prod(np.delete(high - low, flat))
        return rng.uniform(low, high, (int(area / spacing**2), 3))

    return face


def room(noise=0.001, spacing=0.008):
    """A floor of 2 x 1.6 m with a bump of 3 cm at x = 0.8 to 1, a low wall at y < 0.8 and a lintel at y > 0.9."""
    rng = np.random.default_rng(0)
    face = faces(rng, spacing)
    floor = face((0, 0, 0), (2, 1.6, 0))
    floor[(floor[:, 0] > 0.8) & (floor[:, 0] < 1), 2] = 0.03
    wall = [face((x, 0, 0), (x, 0.8, 0.3)) for x in (1.45, 1.55)] + [face((1.45, 0, 0.3), (1.55, 0.8, 0.3))]
    lintel = [face((x, 0.9, 0.37), (x, 1.6, 0.45)) for x in (1.45, 1.5)] + [face((1.45, 0.9, 0.37), (1.5, 1.6, 0.37))]
    points = np.concatenate([floor, *wall, *lintel])
    return points + noise * rng.normal(size=points.shape)


ROOM = room()


def run(tmp_path, points, **options):
    np.savez(tmp_path / "cloud.npz", points=points)
    args = ClassifyArgs(cloud=tmp_path / "cloud.npz", **{"out": tmp_path / "out"} | options)
    assert classify.main(args) == 0
    return class_grid.load(tmp_path / "out" / "classes.npz")


def refused(tmp_path, points=ROOM, **options):
    """The message; nothing may be left behind."""
    np.savez(tmp_path / "cloud.npz", points=points)
    before = sorted(os.listdir(tmp_path))
    with pytest.raises(InputError) as caught:
        classify.main(ClassifyArgs(cloud=tmp_path / "cloud.npz", **{"out": tmp_path / "out"} | options))
    assert sorted(os.listdir(tmp_path)) == before
    return str(caught.value)


def check(grid, away=(0.0, 0.0)):
    found = {xy: grid.classes[grid.cell_at((xy[0] + away[0], xy[1] + away[1]))] for xy in PLACES}
    assert found == PLACES


def test_a_room(tmp_path, capsys):
    check(run(tmp_path, ROOM))
    text = capsys.readouterr().out
    assert (
        f"{len(ROOM)} points\n" in text and "floor     found: z is up, tilted by 0.0" in text and "dropped" not in text
    )
    files = ["classes.npz", "classify.json", "map.png", "voxels.npz", "voxels.png"]
    assert sorted(os.listdir(tmp_path / "out")) == files
    words = ["plan", str(tmp_path / "out" / "classes.npz"), "--start", "0.3", "0.3", "--goal", "1.8", "1.2"]
    assert cli.main([*words, "--out", str(tmp_path / "p")]) == 0
    assert "gate" in (tmp_path / "p" / "path.csv").read_text()  # through it: the wall bars the other way


def floor_with(high, sides=False, floor_below=False, low=0.0):
    """A floor of 2 x 1.6 m and a flat surface of 0.6 x 0.5 m, `high` above it; its four sides down to `low`."""
    rng = np.random.default_rng(1)
    face, (x0, x1, y0, y1) = faces(rng, 0.008), (0.72, 1.32, 0.53, 1.03)
    floor = face((0, 0, 0), (2, 1.6, 0))
    under = (floor[:, 0] > x0) & (floor[:, 0] < x1) & (floor[:, 1] > y0) & (floor[:, 1] < y1)
    parts = [floor if floor_below else floor[~under], face((x0, y0, high), (x1, y1, high))]
    if sides:
        parts += [face((x, y0, low), (x, y1, high)) for x in (x0, x1)]
        parts += [face((x0, y, low), (x1, y, high)) for y in (y0, y1)]
    points = np.concatenate(parts)
    return points + 0.001 * rng.normal(size=points.shape)


MIDDLE, EDGE, BESIDE, AWAY = (1.02, 0.78), (0.76, 0.78), (0.66, 0.78), (0.4, 0.78)


def classes_at(grid, *places):
    return [int(grid.classes[grid.cell_at(xy)]) for xy in places]


@pytest.mark.parametrize("pitch", [0.05, 0.02])
@pytest.mark.parametrize("sides", [True, False], ids=["with sides", "seen from above"])
@pytest.mark.parametrize("high", [0.12, 0.36, 0.40, 0.43, 0.6, 1.5])
def test_a_block_is_an_obstacle_however_high_its_flat_top(tmp_path, high, sides, pitch):
    """Whether its top lies where a squatting head has room, or above every head: nothing is seen below it."""
    grid = run(tmp_path, floor_with(high, sides), pitch=pitch)
    assert classes_at(grid, MIDDLE, EDGE, BESIDE) == [Cell.OBSTACLE] * 3
    assert classes_at(grid, AWAY) == [Cell.FLOOR]


@pytest.mark.parametrize(
    ("high", "expected"),
    [(0.30, Cell.OBSTACLE), (0.37, Cell.GATE), (0.42, Cell.FLOOR), (0.8, Cell.FLOOR), (2.4, Cell.FLOOR)],
)
def test_what_hangs_over_floor_that_was_seen_goes_by_its_clearance(tmp_path, high, expected):
    """A table, a lintel, a ceiling."""
    grid = run(tmp_path, floor_with(high, floor_below=True))
    assert classes_at(grid, MIDDLE, AWAY) == [expected, Cell.FLOOR]


def test_a_table_top_with_an_apron_goes_by_its_clearance(tmp_path):
    grid = run(tmp_path, floor_with(0.45, sides=True, low=0.37, floor_below=True))
    assert classes_at(grid, EDGE, AWAY) == [Cell.GATE, Cell.FLOOR]


@pytest.mark.parametrize(
    ("high", "on_it", "beside"),
    [
        (0.014, Cell.OBSTACLE, Cell.FLOOR),
        (0.025, Cell.BUMP, Cell.FLOOR),
        (0.03, Cell.BUMP, Cell.FLOOR),
        (0.036, Cell.BUMP, Cell.OBSTACLE),
        (0.044, Cell.OBSTACLE, Cell.OBSTACLE),
    ],
)
def test_ground_goes_by_its_height(tmp_path, high, on_it, beside):
    """1.4 cm is no level; 3.6 cm is too high a step from the floor, but not from another bump."""
    grid = run(tmp_path, floor_with(high, sides=True))
    assert classes_at(grid, MIDDLE, BESIDE, AWAY) == [on_it, beside, Cell.FLOOR]


def test_nan_is_dropped_and_said(tmp_path, capsys):
    points = ROOM.copy()
    points[::10] = np.nan
    check(run(tmp_path, points))
    assert f"; {len(points[::10])} NaN or infinite points dropped" in capsys.readouterr().out


@pytest.mark.parametrize("frame", ["-y", "y"])
def test_other_frames_and_tilts(tmp_path, frame, capsys):
    turn = Rotation.from_euler("xy", [6, -4], degrees=True).as_matrix()
    run(tmp_path, (ROOM @ turn.T) @ FRAMES[frame])
    assert f"found: {frame} is up, tilted by 7.2" in capsys.readouterr().out
    said = json.loads((tmp_path / "out" / "classify.json").read_text())
    T = np.array(said["T_map_cloud"])
    points = (ROOM @ turn.T) @ FRAMES[frame] @ T[:3, :3].T + T[:3, 3]
    on_floor = ROOM[:, 2] < 0.01
    assert np.abs(points[on_floor, 2]).max() < 0.012


@pytest.mark.parametrize("given", [True, False])
def test_map_projections(tmp_path, given, capsys):
    """UTM coordinates: the map keeps them, to the cell, and heights are of the floor."""
    away = np.array([450_000.0, 5_410_000.0, 312.4])
    options = {"up": (0.0, 0.0, 1.0), "floor": 312.4} if given else {}
    grid = run(tmp_path, ROOM + away, **options)
    check(grid, away[:2])
    assert grid.extent[0] == pytest.approx(450_000, abs=0.11) and grid.extent[2] == pytest.approx(5_410_000, abs=0.11)
    text = capsys.readouterr().out
    assert "far from 0" in text and ("floor     given: z is up" in text if given else "height 312.40" in text)


def test_a_given_direction_and_millimetres(tmp_path, capsys):
    check(run(tmp_path, ROOM * 1000, scale=0.001, up=(0.0, 0.0, 2.0), tilt=0.0))
    assert "tilted by 0.00 degrees" in capsys.readouterr().out


def test_an_area_and_a_pitch(tmp_path):
    grid = run(tmp_path, ROOM, area=(0.2, 1.7, -0.3, 0.9), pitch=0.1)
    assert grid.extent == pytest.approx((0.2, 1.7, -0.3, 0.9)) and grid.shape == (12, 15)
    assert (grid.classes[:3] == Cell.UNMEASURED).all() and grid.classes[7, 3] == Cell.FLOOR


def test_the_command_line(tmp_path, capsys):
    save_ply(tmp_path / "room.ply", ROOM.astype(np.float32))
    words = ["classify", str(tmp_path / "room.ply"), "--up", "0", "0", "1", "--robot.radius", "0.12", "--out"]
    assert cli.main([*words, str(tmp_path / "o")]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == (
        f"written   {tmp_path / 'o'}: classes.npz, voxels.npz, voxels.png, map.png, classify.json"
    )
    assert cli.main(["classify", str(tmp_path / "none.ply"), "--out", str(tmp_path / "p")]) == 2
    assert capsys.readouterr().err == f"jaxbiped: {tmp_path / 'none.ply'}: no such file\n"


def test_what_is_refused(tmp_path):
    wall = np.random.default_rng(1).uniform((0, 0, 0), (3, 0.01, 2), (20_000, 3))
    text = refused(tmp_path, wall, up=(0.0, 0.0, 1.0))
    assert "cloud.npz: has no detectable floor in its 3 x 0.01 x 2 m; give --floor (and --scale" in text
    text = refused(tmp_path, np.random.default_rng(2).uniform(0, 1, (20_000, 3)))
    assert "give --up X Y Z, and --floor if the floor is not in it" in text
    assert refused(tmp_path, np.zeros((0, 3))).endswith("cloud.npz: must hold finite points; it has none")
    assert refused(tmp_path, floor=0.1) == "floor: goes with --up only (got 0.1)"
    assert refused(tmp_path, up=(0.0, 0.0, 0.0)).startswith("up: must be a direction, not 0 0 0")
    millimetres = ROOM * 1000
    assert "in its 2000 x 1600 x 4" in refused(tmp_path, millimetres)
    assert "pitch: must give at most 4,000,000 cells on the 20" in refused(
        tmp_path, millimetres, up=(0.0, 0.0, 1.0), floor=0.0
    )
    assert "none is there" in refused(tmp_path, up=(0.0, 0.0, 1.0), floor=-20.0)
    assert refused(tmp_path, area=(1.0, 0.0, 0.0, 1.0)).startswith("area: must be finite, X0 < X1 and Y0 < Y1")
    (tmp_path / "out").mkdir()
    assert refused(tmp_path).startswith("out: must be a folder that does not exist yet")


def tilted_table(degrees, noise=0.0007, seed=3):
    """A table of 0.8 x 0.6 m with two boxes on it and a strip of a wall behind, as a camera with y up sees them."""
    rng = np.random.default_rng(seed)

    def face(low, high, n):
        return rng.uniform(low, high, (n, 3))

    parts = [face((0, 0, 0), (0.8, 0.6, 0), 12_000)]
    for x in (0.15, 0.5):
        parts += [face((x, 0.2, 0), (x, 0.4, 0.15), 1_500), face((x, 0.2, 0.15), (x + 0.15, 0.4, 0.15), 1_500)]
    parts += [face((0, 0.75, -0.3), (0.8, 0.75, 0.5), 2_000)]
    points = np.concatenate(parts)
    points += noise * rng.normal(size=points.shape)
    turn = Rotation.from_euler("x", degrees, degrees=True).as_matrix()
    return (points @ turn.T) @ FRAMES["y"]


def test_a_larger_plane_outside_the_search_is_refused_with_up_named(tmp_path, capsys):
    """Of a table tilted by more than the search allows, no slanted cut through what stands on it is the floor."""
    points = tilted_table(38.0)
    text = refused(tmp_path, points, pitch=0.02)
    assert "cloud.npz: shows a plane larger than the floor that was found and tilted by more than 30 degrees" in text
    up = tuple(float(v) for v in re.search(r"give --up X Y Z \((\S+) (\S+) (\S+) if", text).groups())
    run(tmp_path, points, pitch=0.02, up=up)
    assert "y is up, tilted by 38.0" in capsys.readouterr().out


@pytest.mark.parametrize("degrees", [33.0, 50.0])
def test_other_tilts_beyond_the_search_name_up_as_well(tmp_path, degrees):
    assert "give --up X Y Z" in refused(tmp_path, tilted_table(degrees), pitch=0.02)


def test_a_tilt_within_the_search_needs_no_up(tmp_path, capsys):
    run(tmp_path, tilted_table(25.0), pitch=0.02)
    assert "found: y is up, tilted by 24.9" in capsys.readouterr().out


def test_one_point_is_no_floor(tmp_path):
    assert "no detectable floor" in refused(tmp_path, np.zeros((1, 3)))


# The peak of a child's own memory, as the kernel has it for what it runs: what `resource` says of a child begins with
# that of the process that started it, and pytest may hold gigabytes.
PEAK = """
import sys
from jaxbiped import cli
status = cli.main(sys.argv[1:])
print(open("/proc/self/status").read().split("VmHWM:")[1].split()[0])
sys.exit(status)
"""


@pytest.mark.slow
@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="the peak of a process is read from /proc")
@pytest.mark.parametrize("side", [8, 30])
def test_ten_million_points(tmp_path, side):
    """In bounded memory: the points themselves are 120 MB."""
    rng = np.random.default_rng(0)
    points = rng.random((10_000_000, 3), np.float32) * np.float32([side, side, 0.02])
    np.save(tmp_path / "big.npy", points)
    words = ["classify", str(tmp_path / "big.npy"), "--out", str(tmp_path / "o")]
    out = subprocess.run([sys.executable, "-c", PEAK, *words], check=True, timeout=300, capture_output=True, text=True)
    assert 300_000 < int(out.stdout.split()[-1]) < 1_500_000  # [kB]; 0.8 and 1.1 GB
    grid = class_grid.load(tmp_path / "o" / "classes.npz")
    cells = round(side / grid.pitch)
    assert (grid.classes[:cells, :cells] == Cell.FLOOR).mean() > 0.99
