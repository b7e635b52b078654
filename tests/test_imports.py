"""What loads when: help and wrong options are answered without any of the large libraries."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from jaxbiped import cli

ROOT = Path(__file__).parents[1]
HEAVY = {
    "PIL",
    "cv2",
    "jax",
    "jaxlib",
    "llvmlite",
    "matplotlib",
    "mujoco",
    "numba",
    "optax",
    "pandas",
    "polars",
    "scipy",
    "statsmodels",
    "trimesh",
}
SAID = """
import contextlib, io, json, sys
from jaxbiped import cli
statuses = {}
for words in json.loads(sys.argv[1]):
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        try:
            statuses[" ".join(words)] = cli.main(words)
        except SystemExit as stop:
            statuses[" ".join(words)] = stop.code
print(json.dumps([statuses, sorted(sys.modules)]))
"""
LAZY = """
import sys, threading
from jaxbiped import physics, planning
assert "jax" not in sys.modules and "field" in dir(planning) and "field" in planning.__all__
found = []
threads = [threading.Thread(target=lambda: found.append(planning.field)) for _ in range(8)]
for thread in threads: thread.start()
for thread in threads: thread.join()
assert len(found) == 8 and len(set(map(id, found))) == 1 and found[0].__name__ == "field", found
import jaxbiped.planning.cost_field, jaxbiped.planning.reference_astar
from jaxbiped.planning import astar, field
assert callable(field) and callable(astar) and callable(jaxbiped.planning.field), "not their modules"
assert "numba" not in sys.modules and "mujoco" not in sys.modules
from jaxbiped.physics.backend import State
import jaxbiped.physics.backend_choice
assert callable(physics.make) and physics.State is State
try:
    planning.no_such_name
except AttributeError as error:
    assert "jaxbiped.planning" in str(error) and "no_such_name" in str(error)
else:
    raise AssertionError
"""


def child(program, *words):
    """What a program in a process of its own prints."""
    command = [sys.executable, "-c", program, *words]
    done = subprocess.run(command, cwd=ROOT, env=os.environ, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(
    ("last", "status"), [("--help", 0), ("--no-such-option", 2), ("--out=", 2)], ids=["help", "unknown", "no value"]
)
def test_help_and_wrong_options_load_nothing_large(last, status):
    asked = [[command, last] for command in cli.COMMANDS]
    asked += [["--help"], ["--version"]] if not status else [["walk"]]
    asked += [["compare", str(ROOT), last]]  # of a results folder
    if last == "--out=":  # also where a value is none
        asked = [["compare", "--arenas", "0"], ["compare", "--pitch", "wide"], ["run", "x", "--strategy", "brave"]]
        asked += [["plan", "x", "--c0", "-1"], ["stereo", "a", "b", "--camera", "c", "--match.p1", "-1"]]
    statuses, loaded = json.loads(child(SAID, json.dumps(asked)))
    assert statuses == {" ".join(words): status for words in asked}
    assert sorted(HEAVY.intersection(loaded)) == []


def test_the_package_loads_nothing_large():
    loaded = json.loads(child("import json, sys, jaxbiped; print(json.dumps(sorted(sys.modules)))"))
    assert sorted((HEAVY | {"numpy", "pydantic"}).intersection(loaded)) == []


def test_public_names_load_when_used():
    assert child(LAZY) == ""
