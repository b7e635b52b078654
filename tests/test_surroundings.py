"""What a user's shell and rc files set for other programs: overridden, respected, or named in one line."""

import os
import re
import subprocess
import sys
import warnings
from pathlib import Path

import jax
import numpy as np
import polars as pl
import pytest

from jaxbiped import cli, devices, planning, surroundings
from tests.commands.made_up import CASES
from tests.planning.oracle import random_grids

ROOT = Path(__file__).parents[1]
OVERRIDDEN = {
    "JAX_ENABLE_X64": "1",
    "JAX_DISABLE_JIT": "1",
    "JAX_DEBUG_NANS": "1",
    "JAX_DEBUG_INFS": "1",
    "JAX_NUMPY_RANK_PROMOTION": "raise",
    "JAX_NUMPY_DTYPE_PROMOTION": "strict",
    "JAX_DEFAULT_MATMUL_PRECISION": "bfloat16",
    "JAX_THREEFRY_PARTITIONABLE": "0",
    "JAX_DEFAULT_PRNG_IMPL": "rbg",
    "JAX_RANDOM_SEED_OFFSET": "3",
    "JAX_TRANSFER_GUARD": "disallow",
    "JAX_NO_TRACING": "1",
    "JAX_CHECK_TRACER_LEAKS": "1",
    "JAX_SOMETHING_THAT_COMES_LATER": "abc",
    "NUMBA_DISABLE_JIT": "1",
    "NUMBA_NUM_THREADS": "0",
    "NUMBA_CPU_NAME": "no_such_processor",
    "NUMBA_BOUNDSCHECK": "1",
    "NUMBA_OPT": "abc",
    "MPLBACKEND": "module://matplotlib_inline.no_such_backend",
    "PYTHONWARNINGS": "error",
    "PYTHONOPTIMIZE": "2",
    "MUJOCO_GL": "no_such_window",
    "MPLCONFIGDIR": "/proc/nowhere",
    "TMPDIR": "/nowhere",
    "HOME": "/proc/nowhere",
}
ODD_STYLE = {
    "text.usetex": True,
    "font.family": ["NoSuchFont"],
    "axes.grid": True,
    "figure.dpi": 400,
    "lines.linewidth": 9,
}
RC_FILE = "text.usetex: True\nfont.family: NoSuchFont\nfigure.dpi: 700\nlines.linewidth: 9\n"


def child(here, *words, module="tests.commands.pretended", **environment):
    """A command in a process of its own; its exit status and what it said on stderr, but for the bar."""
    both = os.environ | {"PYTHONPATH": str(ROOT)} | environment
    command = [sys.executable, "-m", module, *words]
    done = subprocess.run(command, cwd=here, env=both, capture_output=True, text=True, timeout=600, check=False)
    return done.returncode, [line for line in done.stderr.splitlines() if not line.startswith("busy ")]


def pretended(here, **environment):
    """What the small command stores."""
    here.mkdir()
    status, said = child(here, "pretend", "--draw", **environment)
    assert status == 0, said
    return (here / "out/numbers.txt").read_text(), (here / "out/figure.png").read_bytes()


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return pretended(tmp_path_factory.mktemp("plain") / "here")


def test_variables_that_change_how_libraries_work_are_overridden(tmp_path, plain):
    assert plain[0].startswith("float32 ") and plain[0].endswith(" nan 42")
    assert pretended(tmp_path / "here", **OVERRIDDEN) == plain


@pytest.mark.slow  # each by itself
@pytest.mark.parametrize("name", OVERRIDDEN)
def test_each_variable_is_overridden(tmp_path, plain, name):
    assert pretended(tmp_path / "here", **{name: OVERRIDDEN[name]}) == plain


def test_settings_of_matplotlib_are_overridden(tmp_path, plain):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "matplotlibrc").write_text(RC_FILE)
    assert pretended(tmp_path / "elsewhere", MATPLOTLIBRC=str(tmp_path / "mine")) == plain


def test_settings_of_matplotlib_in_the_working_folder_are_overridden_or_named(tmp_path, plain):
    (tmp_path / "matplotlibrc").write_text(RC_FILE)
    assert child(tmp_path, "pretend", "--draw") == (0, [])
    assert (tmp_path / "out/figure.png").read_bytes() == plain[1]
    (tmp_path / "matplotlibrc").write_bytes(b"\xff\xfe\x00")
    status, said = child(tmp_path, "pretend", "--out", "other")
    assert status == 2 and len(said) == 1 and "matplotlibrc: cannot be read as text" in said[0]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("JAX_PLATFORMS", "cuda"),
        ("JAX_PLATFORMS", "nowhere"),
        ("JAX_PLATFORM_NAME", "gpu"),
        ("JAX_NUM_CPU_DEVICES", "abc"),
        ("JAX_NUM_CPU_DEVICES", "0"),
        ("JAX_LOGGING_LEVEL", "abc"),
        ("XLA_FLAGS", "--xla_no_such_flag=1"),
        ("XLA_FLAGS", "--xla_force_host_platform_device_count=abc"),
        ("XLA_FLAGS", "nonsense"),
    ],
)
def test_variables_that_cannot_be_used_are_named_in_one_line(tmp_path, name, value):
    status, said = child(tmp_path, "pretend", **{"CUDA_VISIBLE_DEVICES": "", name: value})
    assert status == 2 and len(said) == 1 and said[0].startswith(f"jaxbiped: {name}: "), said
    assert repr(value) in said[0] and not os.listdir(tmp_path)


def test_devices_and_caches_are_respected(monkeypatch):
    kept = {
        "JAX_PLATFORMS": "cpu",
        "JAX_NUM_CPU_DEVICES": "2",
        "JAX_COMPILATION_CACHE_DIR": "x",
        "NUMBA_CACHE_DIR": "y",
    }
    kept |= {
        "NUMBA_CACHE_DIR": "y",
        "JAX_LOG_COMPILES": "1",
        "JAX_CUDA_VISIBLE_DEVICES": "0",
        "XLA_PYTHON_CLIENT_PREALLOCATE": "false",
    }
    before = kept | {"JAX_ENABLE_X64": "1", "MPLBACKEND": "TkAgg", "PATH": "/bin"}
    monkeypatch.setattr(os, "environ", dict(before))
    with surroundings.settled():
        assert {name: os.environ.get(name) for name in kept} == kept
        assert "JAX_ENABLE_X64" not in os.environ and os.environ["MPLBACKEND"] == "agg"
    assert os.environ == before  # as a caller of `main` had them


def test_an_error_that_names_no_variable_keeps_its_traceback(monkeypatch):
    monkeypatch.setattr(os, "environ", {"JAX_PLATFORMS": "cpu"})
    assert surroundings.culprit(ValueError("the cpu is wrong")) is None
    line = str(surroundings.culprit(RuntimeError("Unable; set JAX_PLATFORMS='' instead\nand more")))
    assert line == "JAX_PLATFORMS: cannot be used: Unable; set JAX_PLATFORMS='' instead (got 'cpu')"


def test_a_window_system_that_mujoco_does_not_know_is_named(tmp_path):
    scene = str(ROOT / "configs/scenes/experiment_5.toml")
    status, said = child(tmp_path, "run", scene, "--executor", "native", module="jaxbiped", MUJOCO_GL="nonsense")
    assert status == 2 and len(said) == 1 and "MUJOCO_GL" in said[0] and "nonsense" in said[0]


@pytest.mark.parametrize("command", ["native", "stereo"])
def test_a_window_system_whose_library_is_missing_is_named(tmp_path, command):
    """PyOpenGL raises an AttributeError where OSMesa is not installed, at MuJoCo's import."""
    (tmp_path / "OpenGL").mkdir()
    (tmp_path / "OpenGL/__init__.py").write_text("None.glGetError")
    scene, option = str(ROOT / "configs/scenes/experiment_5.toml"), "--sensor" if command == "stereo" else "--executor"
    places = {"PYTHONPATH": f"{tmp_path}:{ROOT}", "MUJOCO_GL": "osmesa"}
    status, said = child(tmp_path, "run", scene, option, command, module="jaxbiped", **places)
    assert status == 2 and len(said) == 1
    assert said[0].startswith("jaxbiped: MUJOCO_GL: its library cannot be loaded: 'NoneType'") and "osmesa" in said[0]


@pytest.mark.slow  # two processes, each of which compiles the closed loop
def test_rows_of_a_comparison_are_the_same_in_any_shell(tmp_path):
    words = ["compare", "--arenas", "4", "--strategies", "full", "floor_only", "--sensor", "oracle", "--out"]
    (tmp_path / "matplotlibrc").write_text(RC_FILE)
    assert child(tmp_path, *words, "plain", module="jaxbiped")[0] == 0
    assert child(tmp_path, *words, "odd", module="jaxbiped", **OVERRIDDEN)[0] == 0
    plain, odd = ((tmp_path / name / "rows" / "part-00000.parquet").read_bytes() for name in ("plain", "odd"))
    assert plain == odd and len(pl.read_parquet(tmp_path / "odd" / "rows")) == 8


@pytest.mark.parametrize("name", ["plan", "run", "report", "report of a sweep", "classify", "reproduce"])
def test_a_caller_with_settings_of_matplotlib_gets_the_same_figures(tmp_path, monkeypatch, name):
    import matplotlib

    def files(here):
        here.mkdir()
        with monkeypatch.context() as patch:
            patch.chdir(here)
            CASES[name].prepare(here, patch)
            assert cli.main(CASES[name].argv) == 0
        found = [path for path in here.rglob("*") if "configs" not in path.parts]
        drawn = {path.name: path.read_bytes() for path in found if path.suffix in (".png", ".gif")}
        pages = {path.name: path.read_text() for path in found if path.suffix == ".html"}
        return drawn | {name: re.findall(r"<svg.*?</svg>|<img[^>]*>", page, re.DOTALL) for name, page in pages.items()}

    plain = files(tmp_path / "plain")
    with matplotlib.rc_context(ODD_STYLE):
        odd = files(tmp_path / "odd")
        assert matplotlib.rcParams["text.usetex"]  # the caller's settings are as they were
    assert plain and plain.keys() == odd.keys() and [name for name in plain if plain[name] != odd[name]] == []


def test_fields_are_the_same_in_a_script_that_has_x64_on():
    classes, levels = random_grids(np.random.default_rng(0), 3, 9, 11)
    goals = np.full((3, 2), 4, np.int64)
    plain = planning.field(classes, levels, goal_ij=goals)
    edges = planning.edge_costs(classes, levels, planning.Costs(), planning.Rules())
    again = planning.cost_to_go(edges, goals)
    with jax.enable_x64(True):
        np.testing.assert_array_equal(planning.field(classes, levels, goal_ij=goals).cost, plain.cost)
        np.testing.assert_array_equal(planning.cost_to_go(edges, goals).cost, again.cost)


def test_cores_are_counted_where_there_is_no_affinity(monkeypatch):
    assert devices.cores() >= 1
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    assert devices.cores() == os.cpu_count()


def test_affinity_is_asked_for_only_where_there_is_one():
    """It is missing on macOS."""
    for folder in ("jaxbiped", "sweeps", "tests"):
        for file in (ROOT / folder).rglob("*.py"):
            text = file.read_text(encoding="utf-8")
            assert "os.sched_" not in text or 'hasattr(os, "sched_' in text or file == Path(__file__), file


def test_a_script_that_turned_numba_off_is_told_so_in_one_line():
    """The command line overrides it; in a script of the user's, Numba is theirs."""
    code = (
        "import numpy as np\nfrom jaxbiped import InputError, planning\ngrid = np.ones((1, 3, 4), np.int8)\n"
        "try:\n    planning.field(grid, 0 * grid, planning.Costs(), planning.Rules(), np.array([[0, 0]]))\n"
        "except InputError as error:\n    print(error)"
    )
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == "NUMBA_DISABLE_JIT: must be 0 or unset: planners and maps are compiled by Numba (got 1)\n"


def test_warnings_of_a_command_are_one_line(capsys):
    with surroundings.settled():
        warnings.warn("metric mine: not finite\n  in 3 missions", RuntimeWarning, stacklevel=1)
    assert capsys.readouterr().err == "jaxbiped: warning: metric mine: not finite in 3 missions\n"
    assert warnings.showwarning is not surroundings.tell
