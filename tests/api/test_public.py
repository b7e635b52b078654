"""The names that `import jaxbiped` gives, and what little it loads."""

import ast
import itertools
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import jaxbiped as jb


def test_every_name_can_be_used_and_is_documented():
    assert 30 <= len(jb.__all__) <= 50 and set(jb.__all__) <= set(dir(jb))
    for name in jb.__all__:
        value = getattr(jb, name)
        assert name == "DIRECTIONS" or value.__doc__
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = jb.nothing


def test_importing_it_loads_no_heavy_library():
    heavy = "jax", "numpy", "matplotlib", "polars", "mujoco", "scipy", "numba", "cv2", "pydantic"
    code = f"import sys, jaxbiped; print([name for name in {heavy} if name in sys.modules])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout == "[]\n"


def test_parts_are_reached_without_an_import_of_their_own():
    code = "import jaxbiped as jb; print(jb.testing.tiny_mission.__name__, jb.planning.field.__name__)"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout == "tiny_mission field\n"


def step_costs(cells):
    """By Eq. 1 on level floor: C0 for each cell, C1 for each move."""
    return sum(np.hypot(*step) + 1 for step in np.diff(cells, axis=0))


def test_a_path_on_a_map_without_a_mission():
    classes = np.full((6, 10), jb.Cell.FLOOR, np.int8)
    classes[1:, 4] = jb.Cell.OBSTACLE
    grid = jb.ClassGrid(classes, np.zeros_like(classes), np.array([1.0, 2.0]), 0.05)
    path = jb.plan(grid, (1.02, 2.22), (1.47, 2.22))
    assert path.cells_ij[0].tolist() == [4, 0] and path.cells_ij[-1].tolist() == [4, 9]
    assert [0, 4] in path.cells_ij.tolist() and path.cost == pytest.approx(step_costs(path.cells_ij))
    assert path.points_xy[0] == pytest.approx([1.025, 2.225])
    classes[0, 4] = jb.Cell.OBSTACLE
    shut = jb.ClassGrid(classes, np.zeros_like(classes), np.array([1.0, 2.0]), 0.05)
    assert jb.plan(shut, (1.02, 2.22), (1.47, 2.22)) is None
    for start, match in [((0.5, 2.2), "must lie on the map"), ((1.22, 2.22), "must not be on an obstacle")]:
        with pytest.raises(jb.InputError, match=match):
            jb.plan(shut, start, (1.47, 2.22))


def test_cells_along_a_line_are_beside_each_other():
    rng = np.random.default_rng(0)
    for _ in range(300):
        points = rng.uniform(0, 9, (rng.integers(1, 5), 2))
        if rng.random() < 0.3:
            points = np.floor(points) + 0.5 * rng.integers(0, 2)  # corners and centres
        cells = jb.cells_along(points)
        assert (np.abs(np.diff(cells, axis=0)).sum(1) == 1).all()
        assert cells[0].tolist() == np.floor(points[0]).tolist() and cells[-1].tolist() == np.floor(points[-1]).tolist()
        for a, b in itertools.pairwise(points):
            for share in np.linspace(0, 1, 50):
                at = a + share * (b - a)
                near = np.abs(cells + 0.5 - at).max(1).min()
                assert near <= 0.5 + 1e-9  # every point of the line lies in a cell, or on its border


def test_free_cells_stand_no_more_than_a_level_above_their_neighbours():
    classes = np.array([[1, 1, 2, 2], [1, 4, 2, 0]], np.int8)
    levels = np.array([[0, 0, 2, 1], [0, 0, 1, 9]], np.int8)
    assert jb.free_cells(classes, levels, (0, 0)).tolist() == [[True, True, False, True], [True, False, True, True]]
    assert jb.free_cells(classes, levels, (0, 2))[0, 2]


def test_names_are_registered_once():
    def planner(*problem):
        return None

    assert jb.register(planner, "lab planner") == "lab planner"
    assert jb.register(planner, "lab planner") == "lab planner"
    with pytest.raises(jb.InputError, match="cannot have one name"):
        jb.register(jb.StraightLine(), "lab planner")
    with pytest.raises(jb.InputError, match="cannot have one name"):
        jb.register(jb.StraightLine(), "full", replace=True)
    assert jb.register(jb.StraightLine(), "lab planner", replace=True) == "lab planner"
    assert jb.Study(strategies=["lab planner"]).config().strategies == ("lab planner",)


@pytest.mark.parametrize("name", ["", " x", "<b>", "a/b", "a\nb", "x" * 41, "../a", "é!", 5])
def test_names_that_cannot_be_shown_are_refused(name):
    with pytest.raises(jb.InputError, match="name of a strategy"):
        jb.Strategy(name)


def test_type_checkers_see_the_same_names():
    """The `.pyi` beside the package, name by name and place by place."""
    origins = vars(jb)["origins_"]
    seen = {}
    for node in ast.parse(Path(jb.__file__).with_suffix(".pyi").read_text()).body:
        if isinstance(node, ast.ImportFrom):
            seen |= {alias.asname: (node.module.removeprefix("jaxbiped."), alias.name) for alias in node.names}
        if isinstance(node, ast.Assign):  # of what is called otherwise where it comes from
            seen[node.targets[0].id] = seen.pop(node.value.id)
    modules = vars(jb)["modules_"]
    assert {name: seen.pop(name) for name in modules} == {name: ("jaxbiped", name) for name in modules}
    assert seen == origins and Path(jb.__file__).with_name("py.typed").exists()
