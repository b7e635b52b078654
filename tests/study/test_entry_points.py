"""What an installed package offers by entry points is known by its names, with nothing to import or to register."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "sweeps" / "examples"
OFFERS = """
[jaxbiped.planners]
lab-afraid = lab_parts:Fearful
[jaxbiped.arenas]
lab-pillars = lab_parts:pillars
[jaxbiped.sensors]
lab-fog = lab_parts:Foggy
[jaxbiped.executors]
lab-slip = lab_parts:Slippery
[jaxbiped.metrics]
lab_turns = lab_parts:Turned
"""
PARTS = """
from dataclasses import dataclass

import jax
import jax.numpy as jnp

import jaxbiped as jb


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Fearful(jb.GridPlanner):
    fear: float = 1.0


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Foggy(jb.RayCast):
    reach: float = 1.0


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Slippery(jb.Kinematic):
    slip: float = 0.1


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Turned(jb.Metric):
    def result(self, state, end):
        return jnp.float32(1), jnp.bool_(True)


def pillars(key):
    return jb.make_arena([jb.Box(centre=(0.9, 0.7), size=(0.2, 0.2), top=0.3)], (0.3, 0.7, 0.0), (1.5, 0.7))
"""
SCRIPT = """
import jaxbiped as jb
from jaxbiped.study.groups import groups_of

study = jb.Study(jb.RandomArenas(families=["bump", "lab-pillars"], count=2), ["full", "lab-afraid"],
                 sensor="lab-fog", executor="lab-slip", metrics=["spl", "lab_turns"])
groups = groups_of(study.config(), None)
names = [name for group in groups for name in group.strategies]
print(names, [type(group.settings.planner).__name__ for group in groups])
print(groups[0].metrics, *(type(part).__name__ for part in (groups[1].settings.sensor, groups[1].settings.executor)))
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
    (tmp_path / "lab_parts.py").write_text(PARTS)
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    return os.environ | {"PYTHONPATH": path}


def test_all_five_kinds_are_found_by_name(installed):
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, env=installed, check=False)
    assert done.returncode == 0, done.stderr
    strategies, parts, families, refused = done.stdout.splitlines()
    assert strategies == "['full', 'lab-afraid'] ['GridPlanner', 'Fearful']"
    assert parts == "('spl', 'lab_turns') Foggy Slippery"
    assert families == "['bump', 'lab-pillars']"
    assert "lab-afraid" in refused and "nobody" in refused


def test_the_command_line_lists_them(installed):
    command = [sys.executable, "-m", "jaxbiped", "compare", "--strategies", "full", "nobody"]
    done = subprocess.run(command, capture_output=True, text=True, env=installed, check=False)
    assert done.returncode == 2 and "lab-afraid" in done.stderr and "lab_parts" not in done.stderr
