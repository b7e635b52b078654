"""`jaxbiped plan` on the three kinds of maps, against Dijkstra, and every way it refuses."""

import csv
import errno
import math
import os
from pathlib import Path

import numpy as np
import pytest
import tyro
from PIL import Image
from scipy.sparse.csgraph import dijkstra

from jaxbiped.commands import plan
from jaxbiped.commands.plan import PlanArgs
from jaxbiped.commands.scenario import ROUNDING, lengths
from jaxbiped.core import class_grid
from jaxbiped.core.class_grid import ClassGrid
from jaxbiped.errors import InputError
from jaxbiped.formats import moving_ai
from jaxbiped.mapping.grid import Cell
from tests.data.make_maps import graph

DATA = Path(__file__).parent.parent / "data"
ROOMS, SCEN, ROS = DATA / "rooms.map", DATA / "rooms.map.scen", DATA / "rooms.yaml"


def run(tmp_path, file, start=None, goal=None, **options):
    return plan.main(PlanArgs(file=file, start=start, goal=goal, **{"out": tmp_path / "out"} | options))


def refused(tmp_path, file, start=None, goal=None, **options):
    """The message; nothing may be left behind."""
    before = sorted(os.listdir(tmp_path))
    with pytest.raises(InputError) as caught:
        run(tmp_path, file, start, goal, **options)
    assert sorted(os.listdir(tmp_path)) == before
    return str(caught.value)


def read_csv(folder):
    with open(folder / "path.csv", newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture
def bumpy(tmp_path):
    """A class grid of 12 x 20 cells with its corner at (-0.2, 0.1): a bar of one step across, a wall with a gate."""
    classes = np.full((12, 20), Cell.FLOOR, np.int8)
    classes[:, 8:10], classes[:, 14] = Cell.BUMP, Cell.OBSTACLE
    classes[5, 14] = Cell.GATE
    levels = (classes == Cell.BUMP).astype(np.int8)
    class_grid.save(ClassGrid(classes, levels, np.array([-0.2, 0.1]), 0.05), tmp_path / "grid.npz")
    return tmp_path / "grid.npz"


def test_a_class_grid_is_planned_with_the_costs_of_the_paper(bumpy, tmp_path, capsys):
    assert run(tmp_path, bumpy, (-0.1, 0.36), (0.74, 0.36)) == 0
    rows = read_csv(tmp_path / "out")
    assert [int(row["row"]) for row in rows] == [5] * 17 and [int(row["column"]) for row in rows] == [*range(2, 19)]
    # 16 straight moves: 2 over an edge of the bar (1 + 10), 2 in and out of the gate (1 + 5), 12 on floor (1 + 1)
    assert float(rows[-1]["cost"]) == pytest.approx(2 * 11 + 2 * 6 + 12 * 2)
    assert rows[6]["class"] == "bump" and rows[6]["level"] == "1" and rows[12]["class"] == "gate"
    assert (float(rows[0]["x_m"]), float(rows[0]["y_m"])) == pytest.approx((-0.075, 0.375))
    text = capsys.readouterr().out
    assert "cost      58\n" in text and "length    0.800 m, 16.000 cells, 16 moves, 0 turns" in text
    assert sorted(os.listdir(tmp_path / "out")) == ["map.png", "path.csv", "path.npz"]
    with np.load(tmp_path / "out" / "path.npz") as saved:
        assert saved["cells_ij"].shape == (17, 2) and saved["xy"].shape == (17, 2) and saved["length_cells"] == 16
        assert saved["cost"][-1] == pytest.approx(58)
    with Image.open(tmp_path / "out" / "map.png") as picture:
        assert picture.size[0] > 700


def test_costs_change_the_path(bumpy, tmp_path):
    assert run(tmp_path, bumpy, (-0.1, 0.36), (0.74, 0.36), c1=0, c2=0, c3=0) == 0
    assert float(read_csv(tmp_path / "out")[-1]["cost"]) == pytest.approx(16)


def test_costs_beyond_single_precision_take_the_fewest_moves(tmp_path):
    """The cost of a cell of floor is lost in the sum, so that all ways over it cost the same."""
    classes = np.where(np.arange(60) < 30, np.int8(Cell.UNMEASURED), np.int8(Cell.FLOOR)) + np.zeros((2, 1), np.int8)
    class_grid.save(ClassGrid(classes, np.zeros_like(classes), np.zeros(2), 0.05), tmp_path / "half.npz")
    assert run(tmp_path, tmp_path / "half.npz", (2.9, 0.02), (0.02, 0.02), c0=0.001, c1=0, c4=1e6) == 0
    rows = read_csv(tmp_path / "out")
    assert [int(row["column"]) for row in rows] == list(range(57, -1, -1))
    assert float(rows[-1]["cost"]) == pytest.approx(30e6, rel=1e-6)


def test_paths_of_any_length(tmp_path):
    grid = ClassGrid(np.ones((3, 26), np.int8), np.zeros((3, 26), np.int8), np.zeros(2), 0.05)
    class_grid.save(grid, tmp_path / "long.npz")
    for k, columns in enumerate((5, 6, 25)):
        goal = (0.05 * columns + 0.02, 0.02)
        assert run(tmp_path, tmp_path / "long.npz", (0.02, 0.02), goal, out=tmp_path / str(k)) == 0
        rows = read_csv(tmp_path / str(k))
        assert [int(row["column"]) for row in rows] == [*range(columns + 1)] and {row["row"] for row in rows} == {"0"}


def test_moving_ai_positions_are_column_and_row(tmp_path, capsys):
    assert run(tmp_path, ROOMS, (1, 1), (33, 1), c1=0) == 0
    rows = read_csv(tmp_path / "out")
    assert (rows[0]["row"], rows[0]["column"]) == ("1", "1") and (rows[-1]["row"], rows[-1]["column"]) == ("1", "33")
    free = np.isin([list(line) for line in ROOMS.read_text().splitlines()[4:]], [".", "G", "S"])
    best = dijkstra(graph(free), directed=False, indices=36 + 1)[36 + 33]
    assert float(rows[-1]["cost"]) == pytest.approx(best, rel=1e-6)  # cost 1 a cell: the pitch is the paper's
    assert "(1, 1), (33, 1)" in capsys.readouterr().out


def test_a_ros_map_is_planned_in_metres_by_yaml_and_by_picture(tmp_path):
    costs = []
    for k, file in enumerate([ROS, ROS.with_suffix(".pgm")]):
        assert run(tmp_path, file, (-0.8, 0.68), (0.75, 0.68), c1=0, out=tmp_path / f"out{k}") == 0
        costs.append(read_csv(tmp_path / f"out{k}")[-1]["cost"])
    assert costs[0] == costs[1]
    free = np.isin([list(line) for line in ROOMS.read_text().splitlines()[4:]], [".", "G", "S"])[::-1]
    i = math.floor((0.68 + 0.5) / 0.05) - 2  # the picture has 2 cells of border, the map none
    start, goal = (i * 36 + math.floor((x + 1.0) / 0.05) - 2 for x in (-0.8, 0.75))
    assert float(costs[0]) == pytest.approx(dijkstra(graph(free), directed=False, indices=start)[goal], rel=1e-6)


def test_a_ros_map_with_a_yaw_is_planned_in_the_frame_of_the_world(tmp_path):
    """The same way as without, each of its points turned about the origin of the map; and the picture is turned."""
    turn = complex(math.cos(1.0), math.sin(1.0))

    def turned(x, y):
        at = complex(-1.0, -0.5) + turn * (complex(x, y) - complex(-1.0, -0.5))
        return at.real, at.imag

    sheet = ROS.read_text()
    assert "- -0.5\n- 0.0\n" in sheet
    (tmp_path / "rooms.pgm").write_bytes(ROS.with_suffix(".pgm").read_bytes())
    (tmp_path / "turned.yaml").write_text(sheet.replace("- -0.5\n- 0.0\n", "- -0.5\n- 1.0\n"))
    start, goal = (-0.8, 0.68), (0.75, 0.68)
    assert run(tmp_path, ROS, start, goal, out=tmp_path / "straight") == 0
    assert run(tmp_path, tmp_path / "turned.yaml", turned(*start), turned(*goal), out=tmp_path / "turned") == 0
    ways = [read_csv(tmp_path / name) for name in ("straight", "turned")]
    assert [row["row"] for row in ways[0]] == [row["row"] for row in ways[1]]
    for one, other in zip(*ways, strict=True):
        assert turned(float(one["x_m"]), float(one["y_m"])) == pytest.approx(
            (float(other["x_m"]), float(other["y_m"])), abs=1e-5
        )
    text = refused(tmp_path, tmp_path / "turned.yaml", (0.9, -0.4), turned(*goal), out=tmp_path / "o")
    assert (
        "start: must lie on the map, x in [-1, 1) m and y in [-0.5, 0.9) m, turned by 1 rad about (-1, -0.5) m" in text
    )


def test_the_suffix_may_lie(bumpy, tmp_path):
    other = tmp_path / "grid.dat"
    other.write_bytes(bumpy.read_bytes())
    assert run(tmp_path, other, (-0.1, 0.36), (0.0, 0.36)) == 0
    (tmp_path / "what.dat").write_text("something else")
    text = refused(tmp_path, tmp_path / "what.dat", (0, 0), (1, 1), out=tmp_path / "b")
    assert text.endswith("must be a Moving AI .map, a ROS map_server .yaml with its .png or .pgm, or a class grid .npz")
    assert refused(tmp_path, tmp_path / "none.dat", (0, 0), (1, 1), out=tmp_path / "b").endswith(
        "none.dat: no such file"
    )


def test_start_is_goal(bumpy, tmp_path):
    assert run(tmp_path, bumpy, (0, 0.36), (0, 0.36)) == 0
    assert [row["cost"] for row in read_csv(tmp_path / "out")] == ["0"]


def test_no_path_is_said_and_leaves_no_folder(tmp_path, capsys):
    classes = np.full((4, 9), Cell.FLOOR, np.int8)
    classes[:, 4] = Cell.OBSTACLE
    class_grid.save(ClassGrid(classes, np.zeros_like(classes), np.zeros(2), 0.05), tmp_path / "w.npz")
    assert run(tmp_path, tmp_path / "w.npz", (0.01, 0.01), (0.44, 0.01)) == 1
    assert capsys.readouterr().out.startswith("no path from (0.025, 0.025) m to (0.425, 0.025) m on ")
    assert os.listdir(tmp_path) == ["w.npz"]


def test_radius_grows_obstacles(tmp_path, capsys):
    assert run(tmp_path, ROS, (-0.425, 0.675), (0.625, -0.275), radius=0.05) == 1  # the doors are one cell wide
    assert "no path" in capsys.readouterr().out


BAD_PLACES = [
    (ROOMS, (1, 1), (36, 1), "goal: must be a whole column from 0 to 35 and row from 0 to 23 (got (36.0, 1.0))"),
    (ROOMS, (1.5, 1), (2, 1), "start: must be a whole column from 0 to 35 and row from 0 to 23 (got (1.5, 1.0))"),
    (ROOMS, (0, 0), (2, 1), "start: must not be inside an obstacle (got (0.0, 0.0))"),
    (ROOMS, (1, 1), (24, 4), "goal: must not be inside an obstacle (got (24.0, 4.0))"),  # water
    (ROS, (-1.1, 0), (0, 0), "start: must lie on the map, x in [-1, 1) m and y in [-0.5, 0.9) m (got (-1.1, 0.0))"),
    (
        ROS,
        (-0.8, 0.68),
        (0, 0.91),
        "goal: must lie on the map, x in [-1, 1) m and y in [-0.5, 0.9) m (got (0.0, 0.91))",
    ),
    (ROS, (-0.88, -0.38), (0, 0), "start: must not be inside an obstacle (got (-0.88, -0.38))"),
]


@pytest.mark.parametrize("file, start, goal, text", BAD_PLACES)
def test_start_and_goal_must_be_free_cells_of_the_map(tmp_path, file, start, goal, text):
    assert refused(tmp_path, file, start, goal) == f"{file}: {text}"


def test_a_robots_file_gives_the_radius(tmp_path, capsys):
    (tmp_path / "robot.toml").write_text("radius = 0.05\nbody_radius = 0.05\n")
    assert run(tmp_path, ROS, (-0.425, 0.675), (0.625, -0.275), robot=tmp_path / "robot.toml") == 1
    assert run(tmp_path, ROS, (-0.425, 0.675), (0.625, -0.275)) == 0
    both = {"robot": tmp_path / "robot.toml", "radius": 0.05, "out": tmp_path / "other"}
    assert "radius: does not go with --robot" in refused(tmp_path, ROS, (-0.425, 0.675), (0.625, -0.275), **both)
    (tmp_path / "robot.toml").write_text("radius = -1\n")
    text = refused(tmp_path, ROS, (0, 0), (0.1, 0), robot=tmp_path / "robot.toml", out=tmp_path / "third")
    assert "robot.toml: radius: must be greater than 0 (got -1)" in text
    assert "does not go with --scenario" in refused(
        tmp_path, ROS, scenario=SCEN, robot=tmp_path / "robot.toml", out=tmp_path / "fourth"
    )


def test_near_an_obstacle_with_a_radius(tmp_path):
    text = refused(tmp_path, ROS, (-0.83, 0.68), (0.75, 0.68), radius=0.05)
    assert "start: must not be inside an obstacle or closer to one than the radius of 0.05 m" in text


BAD_OPTIONS = [
    ({}, "start: must be given as X Y, unless --scenario is given"),
    ({"start": (1, 1)}, "goal: must be given as X Y, unless --scenario is given"),
    ({"start": (1, 1), "goal": (2, 1), "sample": 3}, "sample: goes with --scenario only (got 3)"),
    ({"scenario": SCEN, "start": (1, 1)}, "start: does not go with --scenario"),
    ({"scenario": SCEN, "c1": 0.5}, "c1: does not go with --scenario"),
    ({"scenario": SCEN, "corner_cutting": True}, "corner_cutting: does not go with --scenario"),
    ({"scenario": SCEN, "radius": 0.1}, "radius: does not go with --scenario"),
    ({"scenario": DATA / "none.scen"}, f"{DATA / 'none.scen'}: no such file"),
]


@pytest.mark.parametrize("options, text", BAD_OPTIONS)
def test_options_that_do_not_go_together(tmp_path, options, text):
    assert refused(tmp_path, ROOMS, **options).startswith(text)


def test_a_scenario_wants_a_moving_ai_map(tmp_path):
    assert refused(tmp_path, ROS, scenario=SCEN).startswith(f"{ROS}: scenario: goes with a Moving AI .map only")


def test_bad_maps_are_refused_by_name(bumpy, tmp_path):
    (tmp_path / "cut.map").write_text(ROOMS.read_text()[:300])
    assert refused(tmp_path, tmp_path / "cut.map", (1, 1), (2, 1)).startswith(f"{tmp_path / 'cut.map'}: ")
    (tmp_path / "cut.npz").write_bytes(bumpy.read_bytes()[:200])
    assert refused(tmp_path, tmp_path / "cut.npz", (1, 1), (2, 1)).startswith(f"{tmp_path / 'cut.npz'}: ")
    Image.new("RGB", (9, 9), "red").save(tmp_path / "photo.png")
    assert "is not a map" in refused(tmp_path, tmp_path / "photo.png", (1, 1), (2, 1))


def test_an_existing_folder_is_refused_before_anything_is_read(tmp_path):
    (tmp_path / "out").mkdir()
    text = refused(tmp_path, tmp_path / "missing.map", (1, 1), (2, 1))
    assert text == f"out: must be a folder that does not exist yet (got '{tmp_path / 'out'}')"


def test_a_full_disk_leaves_nothing(bumpy, tmp_path, monkeypatch):
    def full(descriptor):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    assert refused(tmp_path, bumpy, (0, 0.36), (0.1, 0.36)).endswith("cannot be written: no space left on device")
    assert refused(tmp_path, ROOMS, scenario=SCEN).endswith("cannot be written: no space left on device")


def test_the_scenario_in_the_repository_is_solved(tmp_path, capsys):
    assert run(tmp_path, ROOMS, scenario=SCEN) == 0
    assert "equal     40 of 40 optimal lengths" in capsys.readouterr().out
    with open(tmp_path / "out" / "queries.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 40 and all(row["equal"] == "True" for row in rows)


def test_a_wrong_length_is_found(tmp_path, capsys):
    lines = SCEN.read_text().splitlines()
    words = lines[7].split("\t")
    words[-1] = f"{float(words[-1]) + 0.001:.8f}"
    lines[7] = "\t".join(words)
    (tmp_path / "wrong.scen").write_text("\n".join(lines))
    assert run(tmp_path, ROOMS, scenario=tmp_path / "wrong.scen") == 1
    text = capsys.readouterr().out
    assert (
        "equal     39 of 40 optimal lengths" in text
        and f"differs   bucket {words[0]}, ({words[4]}, {words[5]})" in text
    )


def test_a_query_off_the_ground_differs_and_says_why(tmp_path, capsys):
    (tmp_path / "water.scen").write_text("version 1\n0\trooms.map\t36\t24\t24\t4\t25\t4\t1.00000000\n")
    assert run(tmp_path, ROOMS, scenario=tmp_path / "water.scen") == 1
    assert "file 1, found inf; an end is water, trees or out of bounds" in capsys.readouterr().out


def test_a_sample_of_a_scenario(tmp_path, capsys):
    assert run(tmp_path, ROOMS, scenario=SCEN, sample=7) == 0
    assert "7 of 40 queries" in capsys.readouterr().out


def test_lengths_are_octile_and_inf_where_there_is_no_way():
    grid = moving_ai.load_map(ROOMS)
    rng = np.random.default_rng(4)
    start, goal = (np.argwhere(np.ones(grid.shape))[rng.integers(grid.classes.size, size=30)] for _ in range(2))
    goal[:5] = goal[5]  # several queries with one goal
    found = lengths(grid, start, goal)
    edges = graph(grid.classes == Cell.FLOOR)
    for s, g, length in zip(start, goal, found, strict=True):
        free = grid.classes[tuple(s)] == grid.classes[tuple(g)] == Cell.FLOOR
        best = dijkstra(edges, directed=False, indices=s[0] * 36 + s[1])[g[0] * 36 + g[1]] if free else np.inf
        if free:
            assert length == pytest.approx(best, rel=ROUNDING)
        else:
            assert not np.isfinite(length) or (s == g).all()


def test_the_command_line_fills_the_arguments(tmp_path):
    words = ["a.map", "--start", "1", "2.5", "--goal", "3", "4", "--c4", "50", "--corner-cutting", "--out", "o"]
    args = tyro.cli(PlanArgs, args=words)
    assert args == PlanArgs(
        file=Path("a.map"), start=(1.0, 2.5), goal=(3.0, 4.0), c4=50.0, corner_cutting=True, out=Path("o")
    )
    assert (PlanArgs(file=Path("a")).c0, PlanArgs(file=Path("a")).c4) == (1.0, 100.0)


def test_the_default_folder_is_named_after_the_options(bumpy, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for goal in ((0.1, 0.36), (0.2, 0.36)):
        assert plan.main(PlanArgs(file=bumpy, start=(0, 0.36), goal=goal)) == 0
    names = os.listdir(tmp_path / "results")
    assert len(names) == 2 and all(name.startswith("plan-") and len(name) == 17 for name in names)
