"""Hashes of what people bring: the same for the same, other for other code, numbers and closures, in any process."""

import subprocess
import sys
from dataclasses import dataclass, field, replace

import jax
import pytest

from jaxbiped.core.code_hash import component_hash
from jaxbiped.planning.host_planner import HostPlanner
from jaxbiped.planning.planners import GridPlanner

MODULE = """
from dataclasses import dataclass, field
import jax
from jaxbiped.planning.host_planner import HostPlanner
from jaxbiped.planning.planners import GridPlanner

@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Mine(GridPlanner):
    clearance: float = 0.1
    kind: str = field(default="a", metadata={"static": True})

def straight(classes, levels, start, goal, costs):
    return helper(start, goal)

def helper(start, goal):
    return [start, goal]

def made(power):
    return lambda *problem: power
"""
PRINT = """
import sys; sys.path.insert(0, sys.argv[1])
import lab_hash as lab
from jaxbiped.core.code_hash import component_hash
from jaxbiped.planning.host_planner import HostPlanner
for k in range(int(sys.argv[2])): HostPlanner(lab.made(k))
print(component_hash(lab.Mine()), component_hash(HostPlanner(lab.straight)))
"""


def printed(folder, before=0):
    command = [sys.executable, "-c", PRINT, str(folder), str(before)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()


def test_the_same_in_every_process_and_other_where_the_code_is(tmp_path):
    (tmp_path / "lab_hash.py").write_text(MODULE)
    first = printed(tmp_path)
    assert printed(tmp_path, before=3) == first and len(set(first)) == 2
    (tmp_path / "lab_hash.py").write_text(MODULE.replace("[start, goal]", "[goal, start]"))
    assert set(printed(tmp_path)).isdisjoint(first)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Mine(GridPlanner):
    clearance: float = 0.1
    kind: str = field(default="a", metadata={"static": True})


def test_numbers_and_static_fields_count():
    base = Mine()
    others = [replace(base, clearance=0.2), replace(base, kind="b"), GridPlanner()]
    hashes = [component_hash(item) for item in (base, *others)]
    assert len(set(hashes)) == 4 and component_hash(Mine()) == hashes[0]


def nothing(*problem):
    return None


@pytest.mark.parametrize("other", [HostPlanner(nothing, limit=3.0), HostPlanner(lambda *problem: None)])
def test_host_planners_differ_by_function_and_limit(other):
    assert component_hash(other) != component_hash(HostPlanner(nothing))
