"""Programs that are loaded without being traced are the same programs, and are loaded only where that is certain."""

import enum
import os
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.core import program_identity, ready_programs
from jaxbiped.core.lazy_loading import REPLACED
from jaxbiped.core.program_identity import NotOurs, described
from jaxbiped.core.ready_programs import program_file, ready_jit
from jaxbiped.mission.outcome import Code
from jaxbiped.planning.costs import Costs

SCRIPT = """
import sys
import time
import jax, jax.numpy as jnp, numpy as np
from jaxbiped.core.ready_programs import ready_jit

@ready_jit(static_argnames=("power",))
def raised(x, power, shift=1.0):
    print("traced", x.shape, x.dtype, power)
    return {"sum": jnp.sum(x) + shift, "power": jnp.sort(x**power), "nothing": None}

for x, power in eval(sys.argv[1]):
    found = raised(x, power=power)
    print(sorted(found), float(found["sum"]), np.asarray(found["power"]).tolist())
"""
FIELD = """
import numpy as np
from jaxbiped import planning
classes = np.ones((3, 9, 11), np.int8)
classes[:, 4, 1:] = 2
found = planning.field(classes, np.zeros_like(classes), goal_ij=np.array([[8, 8]] * 3))
print(np.asarray(found.cost).tobytes().hex(), np.asarray(found.converged).all())
"""


def run(folder: Path, script: str, *arguments: str, **environment: str) -> str:
    known = {"JAXBIPED_CACHE": str(folder), "JAX_PLATFORMS": "cpu"} | environment
    done = subprocess.run(
        [sys.executable, "-c", script, *arguments], capture_output=True, text=True, env=os.environ | known, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def ready_files(folder: Path) -> list[Path]:
    return [file for file in folder.rglob("ready-*") if file.is_file()]


def test_the_second_process_traces_nothing_and_computes_the_same(tmp_path):
    calls = "[(np.arange(5.0), 2), (np.arange(5.0, dtype=np.float32), 3), (jnp.arange(4), 2), (np.arange(5.0), 2)]"
    first, second = (run(tmp_path, SCRIPT, calls) for _ in range(2))
    assert first.count("traced") == 3 and "traced" not in second
    assert [line for line in first.splitlines() if "traced" not in line] == second.splitlines()
    assert "['nothing', 'power', 'sum'] 11.0 [0.0, 1.0, 4.0, 9.0, 16.0]" in second
    other = run(tmp_path, SCRIPT, "[(np.arange(6.0), 2), (np.arange(5), 2), (np.arange(5.0), 4)]")
    assert other.count("traced") == 3  # another shape, another type, another static number
    assert run(tmp_path, SCRIPT, "[(np.arange(5.0), 2)]", XLA_FLAGS="--xla_cpu_enable_fast_math=true").count("traced")


def test_files_that_are_damaged_are_made_anew(tmp_path):
    run(tmp_path, SCRIPT, "[(np.arange(5.0), 2)]")
    (file,) = ready_files(tmp_path)
    whole = file.read_bytes()
    for damaged in (b"", whole[:40], whole[:-1], b"x" + whole, whole[:-9] + bytes(9)):
        file.write_bytes(damaged)
        assert "traced" in run(tmp_path, SCRIPT, "[(np.arange(5.0), 2)]")
        assert "traced" not in run(tmp_path, SCRIPT, "[(np.arange(5.0), 2)]")
    file.unlink()
    file.mkdir()  # what cannot be written
    assert "sum" in run(tmp_path, SCRIPT, "[(np.arange(5.0), 2)]")
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    assert "traced" in run(blocked, SCRIPT, "[(np.arange(5.0), 2)]")
    assert "traced" in run(Path("off"), SCRIPT, "[(np.arange(5.0), 2)]")


def test_a_program_that_came_from_the_cache_of_jax_can_be_kept(tmp_path):
    """XLA writes no whole program of one that it has read: the first run's bytes are kept."""
    first = run(tmp_path, FIELD)
    kept = ready_files(tmp_path)
    assert kept
    for file in kept:
        file.unlink()
    assert run(tmp_path, FIELD) == first  # read from the cache of JAX, if it took long enough to be there
    assert {file.name for file in ready_files(tmp_path)} == {file.name for file in kept}
    assert run(tmp_path, FIELD) == first and first.endswith("True\n")  # its kernel is there, too


def test_several_devices_and_a_chosen_cache_are_left_to_jax(tmp_path):
    once = "[(np.arange(5.0), 2)]"
    assert "traced" in run(tmp_path, SCRIPT, once, XLA_FLAGS="--xla_force_host_platform_device_count=2")
    assert "traced" in run(tmp_path, SCRIPT, once, JAX_COMPILATION_CACHE_DIR=str(tmp_path / "theirs"))
    assert not ready_files(tmp_path)
    assert "traced" in run(tmp_path, SCRIPT, once, JAX_DISABLE_JIT="1")


@ready_jit(static_argnames=("times",))
def scaled(x, y=2.0, *, times):
    """(x + y) `times` times."""
    return (x + y) * times


def test_what_was_replaced_is_traced_anew(monkeypatch):
    seen = []

    @ready_jit
    def noted(x):
        seen.append(x)
        return x + 1

    REPLACED.clear()
    assert (noted(1.0), noted(2.0)) == (2.0, 3.0)
    monkeypatch.setattr(ready_programs, "KIND", b"other")
    before = len(seen)
    assert noted(1.0) == 2.0 and len(seen) == before + 1
    jax.clear_caches()
    assert noted(1.0) == 2.0 and len(seen) == before + 2
    monkeypatch.undo()
    REPLACED.clear()


def test_it_is_a_function_like_any_other():
    assert scaled.__name__ == "scaled" and scaled.__doc__
    x = jnp.arange(3.0)
    for found in (scaled(x, times=3), scaled(x, 2, times=3), scaled(x=x, y=jnp.float32(2), times=3)):
        assert found.dtype == jnp.float32 and found.tolist() == [6, 9, 12]
    assert scaled(1, 2, times=2).weak_type == jax.jit(lambda x, y: (x + y) * 2)(1, 2).weak_type
    assert jax.vmap(lambda x: scaled(x, times=2))(x).tolist() == [4, 6, 8]
    assert jax.grad(lambda x: scaled(x, times=5))(1.0) == 5
    assert jax.jit(lambda x: scaled(x, times=2))(x).tolist() == [4, 6, 8]
    with pytest.raises(TypeError, match="missing a required"):
        scaled(times=2)
    with pytest.raises(TypeError, match=r"unhashable|non-hashable"):
        scaled(x, times=[2])
    with jax.disable_jit():
        assert scaled(x, times=2).tolist() == [4, 6, 8]


@dataclass(frozen=True)
class Theirs:
    number: float = 1.0


class TheirEnum(enum.Enum):
    A = 1


def test_only_what_is_of_this_package_or_plain_is_described():
    costs = Costs(*map(np.float32, range(5)))
    assert list(described(costs, traced=True)) == list(described(Costs(*map(np.float32, range(2, 7))), traced=True))
    assert list(described((1, "a", None, Code.REACHED))) != list(described((1, "a", None, Code.FELL)))
    assert list(described((1, (2,)))) != list(described(((1, 2),)))
    assert list(described({"b": 1, "a": 2})) == list(described({"a": 2, "b": 1}))
    for thing in (
        Theirs(),
        TheirEnum.A,
        print,
        lambda: 0,
        Theirs,
        (1, [print]),
        {"a": Theirs()},
        np.zeros(2),
        object(),
    ):
        with pytest.raises(NotOurs):
            list(described(thing))
        with pytest.raises(NotOurs):
            list(described({"of": thing} if not isinstance(thing, np.ndarray) else [print], traced=True))


@dataclass(frozen=True)
class Half:
    array: np.ndarray
    name: str = field(metadata={"static": True}, default="a")


def test_static_fields_of_arguments_count(monkeypatch):
    monkeypatch.setattr(Half, "__module__", "jaxbiped.made_up")
    a, b, c = (list(described(half, traced=True)) for half in (
        Half(np.zeros(2)), Half(np.ones(2)), Half(np.zeros(2), "b")))  # fmt: skip
    assert a == b != c


def test_nothing_is_kept_once_the_package_was_changed(tmp_path, monkeypatch):
    monkeypatch.setenv("JAXBIPED_CACHE", str(tmp_path))
    REPLACED.clear()
    before = program_file("name", (np.zeros(3),), 1)
    monkeypatch.setattr(program_identity, "package_hash", lambda: "other")
    program_identity.of_this_machine.cache_clear()
    assert before and "jaxbiped.core.program_identity.package_hash" in REPLACED
    assert program_file("name", (np.zeros(3),), 1) is None
    REPLACED.clear()
    assert program_file("name", (np.zeros(3),), 1) not in (None, before)
    monkeypatch.undo()
    program_identity.of_this_machine.cache_clear()
    REPLACED.clear()


def test_replacing_anything_in_a_module_is_seen():
    code = """
import jaxbiped as jb
from jaxbiped.core.lazy_loading import REPLACED
from jaxbiped.mission import batched_driver
import jaxbiped.planning.cost_field, jaxbiped.study.evaluation, jaxbiped.arenas.families, jaxbiped.formats.elevation
jb.play, jb.Study, jb.planning.field, jb.mapping.update
print(sorted(REPLACED))
batched_driver.TURNS = 4
jaxbiped.arenas.families.MAX_BOXES = 3
print(sorted(REPLACED))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n['jaxbiped.arenas.families.MAX_BOXES', 'jaxbiped.mission.batched_driver.TURNS']\n"


PATCHED = """
import jaxbiped as jb
import jaxbiped.study.evaluation, jaxbiped.api.results, jaxbiped.report.page, jaxbiped.mission.simulated_driver
from jaxbiped.core import program_identity
print(program_identity.has_foreign_methods(), sorted(program_identity.REPLACED))
def blind(self, *_):
    raise AssertionError
jb.Oracle.measure = blind
print(program_identity.has_foreign_methods(), sorted(program_identity.REPLACED))
"""


def test_replacing_a_method_of_a_class_is_seen(tmp_path):
    said = run(tmp_path, PATCHED).splitlines()
    assert said == ["False []", "True ['jaxbiped.mission.sensors.Oracle.blind']"]


def test_files_that_were_edited_since_they_were_read_are_not_trusted(tmp_path, monkeypatch):
    program_identity.package_hash.cache_clear()
    here = tmp_path / "package"
    here.mkdir()
    (here / "module.py").write_text("a = 1\n")
    monkeypatch.setattr(program_identity, "PACKAGE", here)
    with pytest.raises(OSError):  # it is newer than this process
        program_identity.package_hash()
    monkeypatch.setattr(program_identity, "IMPORTED", time.time() + 5)
    first = program_identity.package_hash()
    (here / "module.py").write_text("a = 2\n")
    program_identity.package_hash.cache_clear()
    assert program_identity.package_hash() != first
    (here / "module.py").rename(here / "module.txt")
    program_identity.package_hash.cache_clear()
    with pytest.raises(OSError):  # there is no text
        program_identity.package_hash()
    monkeypatch.undo()
    program_identity.package_hash.cache_clear()
    REPLACED.clear()


def test_settings_of_the_compiler_count(tmp_path, monkeypatch):
    once = "[(np.arange(5.0), 2)]"
    run(tmp_path, SCRIPT, once)
    for name, value in (("JAX_DISABLE_MOST_OPTIMIZATIONS", "1"), ("JAX_OPTIMIZATION_LEVEL", "O0")):
        assert "traced" in run(tmp_path, SCRIPT, once, **{name: value})
    before = len(ready_files(tmp_path))
    assert "traced" in run(tmp_path, SCRIPT, "[(np.arange(7.0), 2)]", JAX_ENABLE_COMPILATION_CACHE="0")
    assert len(ready_files(tmp_path)) == before
