"""What an installed package offers by entry points is known by its names, with nothing to import or to register."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "sweeps" / "examples"
OFFERS = """
[jaxbiped.planners]
lab-careful = lab_planner:Clearance
[jaxbiped.arenas]
lab-corridor = lab_arenas:corridor
[jaxbiped.sensors]
lab-fog = lab_sensor:ShortSighted
[jaxbiped.executors]
lab-slip = lab_executor:Slippery
[jaxbiped.metrics]
lab_turns = lab_metric:TurnedAngle
"""
PARTS = {
    "lab_planner": "planners/clearance",
    "lab_arenas": "06_own_arenas",
    "lab_metric": "07_own_metric",
    "lab_sensor": "08_own_sensor",
    "lab_executor": "09_own_executor",
}  # modules of the package, which are the examples
SCRIPT = """
import jaxbiped as jb
from jaxbiped.study.batching import groups_of

study = jb.Study(jb.RandomArenas(families=["bump", "lab-corridor"], count=2), ["full", "lab-careful"],
                 sensor="lab-fog", executor="lab-slip", metrics=["spl", "lab_turns"])
groups = groups_of(study.config(), None)
names = [name for group in groups for name in group.strategies]
print(names, [type(group.params.planner).__name__ for group in groups])
print(groups[0].metrics, *(type(part).__name__ for part in (groups[1].params.sensor, groups[1].params.executor)))
print([getattr(family, "name", family) for family in groups[0].kind.families])
try:
    jb.Study(jb.RandomArenas(count=2), ["nobody"]).config()
except jb.InputError as error:
    print(error)
"""


@pytest.fixture
def installed(tmp_path):
    """The environment of a process in which such a package is installed."""
    info = tmp_path / "lab_parts-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: lab-parts\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(OFFERS)
    for module, example in PARTS.items():
        (tmp_path / f"{module}.py").write_text((EXAMPLES / f"{example}.py").read_text())
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    return os.environ | {"PYTHONPATH": path}


def test_all_five_kinds_are_found_by_name(installed):
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, env=installed, check=False)
    assert done.returncode == 0, done.stderr
    strategies, parts, families, refused = done.stdout.splitlines()
    assert strategies == "['full', 'lab-careful'] ['GridPlanner', 'Clearance']"
    assert parts == "('spl', 'lab_turns') ShortSighted Slippery"
    assert families == "['bump', 'lab-corridor']"
    assert "lab-careful" in refused and "nobody" in refused


def test_the_command_line_lists_them(installed):
    command = [sys.executable, "-m", "jaxbiped", "compare", "--strategies", "full", "nobody"]
    done = subprocess.run(command, capture_output=True, text=True, env=installed, check=False)
    assert done.returncode == 2 and "lab-careful" in done.stderr and "lab_planner" not in done.stderr
