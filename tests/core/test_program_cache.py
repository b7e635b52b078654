"""Executables on disk: the next process loads them; whatever is wrong with the disk, they are compiled anew."""

import json
import os
import subprocess
import sys
import warnings
from pathlib import Path

import jax
import jax.numpy as jnp
import pytest

from jaxbiped import jax_settings
from jaxbiped.core import kept_files, program_cache
from jaxbiped.core.cache_location import VARIABLE

ROOT = Path(__file__).parents[2]
HIT, MISS = "/jax/compilation_cache/cache_hits", "/jax/compilation_cache/cache_misses"


@pytest.fixture
def seen():
    """Events of JAX's cache."""
    events = []

    def note(name, **_):
        if name in (HIT, MISS):
            events.append(name)

    jax.monitoring.register_event_listener(note)
    yield events
    jax.monitoring.unregister_event_listener(note)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty cache, in which everything is kept that was compiled."""
    monkeypatch.setenv(VARIABLE, str(tmp_path / "kept"))
    before = jax.config.jax_persistent_cache_min_compile_time_secs
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    yield tmp_path / "kept" / "programs" / program_cache.processor()
    jax.config.update("jax_persistent_cache_min_compile_time_secs", before)


def compiled_anew():
    """A program that no other test has, compiled as in a new process; its result."""

    def triple(x):
        return jnp.sin(3 * x).sum()

    with warnings.catch_warnings():
        warnings.simplefilter("error")  # nothing is said of the disk
        return float(jax.jit(triple)(jnp.arange(7.0)))


def test_what_is_compiled_is_kept_and_loaded(folder, seen):
    first = compiled_anew()
    assert seen.count(HIT) == 0 and seen.count(MISS) >= 1
    kept = [file.name for file in folder.iterdir()]
    assert any(name.startswith("jit_triple-") for name in kept)
    seen.clear()
    assert compiled_anew() == first and HIT in seen and MISS not in seen
    assert sorted(file.name for file in folder.iterdir()) == sorted(kept)


def test_damaged_files_are_compiled_anew_and_healed(folder, seen):
    first = compiled_anew()
    (path,) = folder.glob("jit_triple-*")
    whole = path.read_bytes()
    for data in (b"", whole[:-1], whole[:100], b"x" + whole, os.urandom(len(whole))):
        path.write_bytes(data)
        seen.clear()
        assert compiled_anew() == first and MISS in seen
        assert path.read_bytes()[:50] == whole[:50] or len(path.read_bytes()) > 100  # times of compiling differ
        seen.clear()
        assert compiled_anew() == first and MISS not in seen and HIT in seen


def test_of_another_version_nothing_is_loaded(folder, seen, monkeypatch):
    first = compiled_anew()
    monkeypatch.setattr(program_cache, "KIND", b"jaxbiped program 0\n")
    seen.clear()
    assert compiled_anew() == first and HIT not in seen
    monkeypatch.setattr(program_cache, "processor", lambda: "another")
    seen.clear()
    assert compiled_anew() == first and HIT not in seen and (folder.parent / "another").is_dir()


def test_without_a_folder_it_works_all_the_same(folder, tmp_path, monkeypatch, seen):
    (tmp_path / "file").write_text("no folder")
    first = None
    for value in (
        "off",
        "OFF",
        str(tmp_path / "file"),
        str(tmp_path / "file" / "below"),
        "/proc/none",
        "~nobody_here/x",
    ):
        monkeypatch.setenv(VARIABLE, value)
        result = compiled_anew()
        first = result if first is None else first
        assert result == first and HIT not in seen
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_full_disk_keeps_nothing(folder, monkeypatch, seen):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    assert compiled_anew() == compiled_anew() and HIT not in seen
    assert kept_files.files(folder) == []


def test_it_is_bounded(folder, monkeypatch):
    monkeypatch.setattr(program_cache, "MOST_PROGRAMS", 1)
    monkeypatch.setattr(program_cache, "SHARE", 1)
    compiled_anew()
    assert [file for file in folder.rglob("*") if file.is_file()] == []


CHOSEN = """
import json, os, sys
import jax, jax.numpy as jnp
when, folder = sys.argv[1:]
if when == "before":
    jax.config.update("jax_compilation_cache_dir", folder)
from jaxbiped import jax_settings
if when == "after":
    jax.config.update("jax_compilation_cache_dir", folder)
print(jax.config.jax_persistent_cache_min_compile_time_secs)
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
jax.jit(lambda x: jnp.cos(x).sum())(jnp.arange(5.0))
"""


@pytest.mark.parametrize("when", ["environment", "before", "after"])
def test_a_cache_that_the_user_has_chosen_is_used_and_no_other(tmp_path, when):
    both = os.environ | {"PYTHONPATH": str(ROOT), VARIABLE: str(tmp_path / "ours")}
    if when == "environment":
        both["JAX_COMPILATION_CACHE_DIR"] = str(tmp_path / "theirs")
    command = [sys.executable, "-c", CHOSEN, when, str(tmp_path / "theirs")]
    done = subprocess.run(command, env=both, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0 and done.stderr == "", done.stderr
    assert (json.loads(done.stdout) == 1.0) == (when != "after")
    assert [path.name for path in tmp_path.iterdir()] == ["theirs"] and list((tmp_path / "theirs").iterdir())


def test_settling_twice_changes_nothing():
    from jax._src import compilation_cache

    ours = compilation_cache._cache
    program_cache.keep_programs()
    assert compilation_cache._cache is ours and type(ours).__name__ == "Programs" and jax_settings
