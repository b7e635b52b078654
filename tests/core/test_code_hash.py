"""Hashes of what people bring: the same for the same, other for other code, numbers and closures, in any process."""

import functools
import subprocess
import sys
from dataclasses import dataclass, field, replace

import jax
import pytest

import jaxbiped as jb
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
from jaxbiped.arenas.source import Family
print(component_hash(lab.Mine()), component_hash(HostPlanner(lab.straight)), Family("mine", lab.straight).digest())
"""


def printed(folder, before=0):
    command = [sys.executable, "-c", PRINT, str(folder), str(before)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()


def test_the_same_in_every_process_and_other_where_the_code_is(tmp_path):
    (tmp_path / "lab_hash.py").write_text(MODULE)
    first = printed(tmp_path)
    assert printed(tmp_path, before=3) == first and len(set(first)) == 3
    (tmp_path / "lab_hash.py").write_text(MODULE.replace("[start, goal]", "[goal, start]"))
    assert set(printed(tmp_path)).isdisjoint(first)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Mine(GridPlanner):
    clearance: float = 0.1
    kind: str = field(default="a", metadata={"static": True})


def lab(power, *, scale=1.0):
    return lambda *problem: power * scale


class Callable:
    def __init__(self, power):
        self.power = power

    def __call__(self, *problem):
        return self.power


def test_what_functions_hold_counts():
    held = [lab(1), lab(2), lab(1, scale=2.0), functools.partial(lab, 1), functools.partial(lab, 2)]
    held += [Callable(1), Callable(2), Callable(1).__call__, jax.jit(lab(1)), jax.jit(lab(2))]
    hashes = [component_hash(HostPlanner(item)) for item in held]
    assert len(set(hashes[:8])) == 8 and hashes[8] != hashes[9]
    assert component_hash(HostPlanner(Callable(1))) == hashes[5] and component_hash(HostPlanner(lab(1))) == hashes[0]


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


def test_classes_that_have_moved_keep_the_hash_that_studies_stored():
    assert (component_hash(jb.Kinematic()), component_hash(jb.Sampled())) == ("de499a35bb1f", "4e31bbefee35")
