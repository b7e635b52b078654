"""Kernels kept on disk: the same functions, loaded; and whatever is wrong with the disk, compiled anew."""

import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numba import njit

from jaxbiped.core import machine_code, xla_ffi
from jaxbiped.core.cache_location import VARIABLE, cache_folder

NAME = "jaxbiped_test_doubled"


@njit
def doubled(arguments, count, results):
    size = xla_ffi.shape(arguments, 0)[0]
    given = xla_ffi.array(arguments, 0, size, np.float64)
    room = np.zeros(size)  # of Numba's own runtime
    for i in range(size):
        room[i] = 2 * given[i] + count
    xla_ffi.array(results, 0, size, np.float64)[:] = room


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "cache"))
    yield tmp_path / "cache" / "kernels" / machine_code.key()
    for known in (xla_ffi.HANDLERS, xla_ffi.ADDRESSES):
        known.pop(NAME, None)


def answer():
    given, made = np.arange(5.0), np.zeros(5)
    xla_ffi.call(NAME, (given,), (made,))
    return made.tolist()


def test_what_is_kept_is_the_same_function(folder):
    xla_ffi.compile_handler(NAME, doubled, keep=True)
    compiled = answer()
    assert compiled == [1, 3, 5, 7, 9] and [file.name for file in folder.iterdir()] == [NAME]
    address = machine_code.load(NAME)
    assert address and address != xla_ffi.ADDRESSES[NAME]
    xla_ffi.ADDRESSES[NAME] = address
    assert answer() == compiled
    del xla_ffi.HANDLERS[NAME]
    xla_ffi.compile_handler(NAME, None, keep=True)  # nothing is left to compile
    assert answer() == compiled and NAME not in xla_ffi.HANDLERS


def test_a_damaged_file_is_none(folder):
    assert machine_code.load(NAME) is None
    xla_ffi.compile_handler(NAME, doubled, keep=True)
    whole = (folder / NAME).read_bytes()
    other = bytes([whole[-1] ^ 1])
    wrong = [whole[:n] for n in (0, 1, 17, 18, 49, 50, 51, 200, len(whole) // 2, len(whole) - 1)]
    wrong += [
        whole + b"x",
        whole[:-1] + other,
        b"x" + whole[1:],
        whole.replace(b"kernel 1", b"kernel 2"),
        os.urandom(999),
    ]
    for data in wrong:
        (folder / NAME).write_bytes(data)
        assert machine_code.load(NAME) is None
    xla_ffi.compile_handler(NAME, doubled, keep=True)
    assert (
        answer() == [1, 3, 5, 7, 9]
        and (folder / NAME).read_bytes()[:50] == whole[:18] + (folder / NAME).read_bytes()[18:50]
    )
    assert machine_code.load(NAME)
    (folder / NAME).unlink()
    (folder / NAME).mkdir()
    assert machine_code.load(NAME) is None


def test_without_a_folder_it_works_all_the_same(folder, tmp_path, monkeypatch):
    for value in ("off", "OFF"):
        monkeypatch.setenv(VARIABLE, value)
        assert cache_folder() is None
    xla_ffi.compile_handler(NAME, doubled, keep=True)
    assert answer() == [1, 3, 5, 7, 9] and list(tmp_path.iterdir()) == []
    (tmp_path / "file").write_text("no folder")
    for wrong in (tmp_path / "file", tmp_path / "file" / "below", "/proc/none", "~nobody_of_this_name/x"):
        monkeypatch.setenv(VARIABLE, str(wrong))
        xla_ffi.compile_handler(NAME, doubled, keep=True)
        assert answer() == [1, 3, 5, 7, 9] and machine_code.load(NAME) is None


def test_a_changed_source_has_another_key(tmp_path, monkeypatch):
    shutil.copytree(machine_code.PACKAGE / "planning", tmp_path / "planning")
    monkeypatch.setattr(machine_code, "SOURCES", (tmp_path / "planning",))
    first = machine_code.key.__wrapped__()
    assert first == machine_code.key.__wrapped__()
    with (tmp_path / "planning" / "costs.py").open("a") as file:
        file.write("#")
    assert machine_code.key.__wrapped__() != first


def test_only_the_last_versions_stay(folder):
    for k in range(machine_code.OLDEST + 4):
        old = folder.parent / f"old{k}"
        old.mkdir(parents=True)
        (old / "kernel").write_text("x")
        os.utime(old, (1000 + k, 1000 + k))
    xla_ffi.compile_handler(NAME, doubled, keep=True)
    left = {f.name for f in folder.parent.iterdir()}
    assert (
        len(left) == machine_code.OLDEST
        and folder.name in left
        and "old0" not in left
        and f"old{machine_code.OLDEST + 3}" in left
    )


def test_many_at_once(folder):
    xla_ffi.compile_handler(NAME, doubled, keep=True)
    handler = xla_ffi.HANDLERS[NAME]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda _: machine_code.store(NAME, handler), range(40)))
    assert [file.name for file in folder.iterdir()] == [NAME] and machine_code.load(NAME)


PROGRAM = """
import sys
import jax
import numpy as np
from jaxbiped import planning
from jaxbiped.core import xla_ffi

jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
missed = []
jax.monitoring.register_event_listener(lambda name, **_: missed.append(name) if name.endswith("cache_misses") else None)
classes, levels = np.ones((1, 9, 12), np.int8), np.zeros((1, 9, 12), np.int8)
classes[0, 3, 2:9], classes[0, 5:7, 4:8], levels[0, 5:7, 4:8] = 4, 2, 1
for method in sys.argv[1:]:
    found = planning.field(classes, levels, goal_ij=[[7, 3]], method=method)
    print(method, bool(found.converged.all()), np.asarray(found.cost).tobytes().hex())
many = planning.field(np.repeat(classes, 40, 0), np.repeat(levels, 40, 0), goal_ij=[[7, 3]] * 40)
edges = planning.edge_costs(classes, levels)
for method in sys.argv[1:]:
    print(np.asarray(planning.cost_to_go(edges, [[7, 3]], method).cost).tobytes().hex())
    headings = planning.heading_field(classes, levels, goal_ij=[[7, 3]], method=method)
    print(bool(headings.converged.all()), np.asarray(headings.cost).tobytes().hex())
print(many.cost[39].tobytes().hex())
print("compiled", len(xla_ffi.HANDLERS), "of", len(xla_ffi.ADDRESSES), "and", len(missed))
"""


def test_the_next_process_compiles_no_kernel_and_no_program():
    """Of those of the suite, which all processes share."""
    words = [sys.executable, "-c", PROGRAM, "line_sweep", "dijkstra"]
    first, second = (
        subprocess.run(words, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines() for _ in range(2)
    )
    assert second[-1] == "compiled 0 of 7 and 0" and " of 7 and " in first[-1] and first[:-1] == second[:-1]


CHANGED = """
import sys
import jax, jax.numpy as jnp, numpy as np
from numba import njit
from jaxbiped.jax_settings import own_settings
from jaxbiped.core import xla_ffi

factor = int(sys.argv[1])

@njit
def scaled(arguments, count, results):
    size = xla_ffi.shape(arguments, 0)[0]
    given = xla_ffi.array(arguments, 0, size, np.float32)
    xla_ffi.array(results, 0, size, np.float32)[:] = factor * given

xla_ffi.register("jaxbiped_test_scaled", scaled)
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
hits = []
jax.monitoring.register_event_duration_secs_listener(
    lambda name, _, **more: hits.append(name) if name.endswith("compile_time_saved_sec") else None
)
call = jax.jit(lambda x: jax.ffi.ffi_call("jaxbiped_test_scaled", jax.ShapeDtypeStruct((4,), jnp.float32))(x))
found = call(np.arange(4, dtype=np.float32))
print(found.tolist(), len(hits))
"""


def test_an_executable_from_the_disk_calls_the_kernels_of_its_own_process(tmp_path):
    """After a change of a kernel's code alone the program is the same, and must not bring the old kernel back."""
    both = os.environ | {VARIABLE: str(tmp_path)}
    said = [
        subprocess.run(
            [sys.executable, "-c", CHANGED, factor], env=both, check=True, stdout=subprocess.PIPE, text=True
        ).stdout
        for factor in ("2", "2", "3")
    ]
    assert said == ["[0.0, 2.0, 4.0, 6.0] 0\n", "[0.0, 2.0, 4.0, 6.0] 1\n", "[0.0, 3.0, 6.0, 9.0] 1\n"]
