"""XLA's executables on disk: what one process compiled, the next one loads.

This is the part of JAX's own cache that reads and writes files: bounded in size without another library, silent if the
disk is full, read-only or damaged, and repaired by the next writer. JAX's key is a hash of the lowered program, of the
versions of JAX and XLA and of their options; the folder's name identifies the processor, whose instructions an
executable may use. An executable calls kernels (`core.xla_ffi`) by name, and finds those of its own process: it
contains none of their code.

A cache chosen by the user (`JAX_COMPILATION_CACHE_DIR`) is left to JAX.
"""

from __future__ import annotations

import hashlib
import platform
import threading
from functools import cache
from pathlib import Path

import jax

from jaxbiped.core import kept_files
from jaxbiped.core.cache_location import MOST_PROGRAMS, PROGRAMS, cache_folder

KIND = b"jaxbiped program 1\n"
QUICK = 0.05  # [s] compile time below which programs are not kept
LAST = threading.local()  # its `value`: the last entry that this thread read or wrote
SHARE = 16  # number of files written between two checks of their sizes


def keep_programs() -> None:
    """Keep executables from now on, unless the user has chosen a cache of their own. Free of cost the second time."""
    try:
        from jax._src import compilation_cache
        from jax._src.compilation_cache_interface import CacheInterface

        with compilation_cache._cache_initialized_mutex:
            if jax.config.jax_compilation_cache_dir or compilation_cache._cache_initialized:
                return
            compilation_cache._cache = kind_of_cache(compilation_cache, CacheInterface)()
            compilation_cache._cache_initialized = True
        if jax.config.jax_persistent_cache_min_compile_time_secs == 1.0:  # the default
            jax.config.update("jax_persistent_cache_min_compile_time_secs", QUICK)
    except (ImportError, AttributeError):  # with other internals of JAX nothing is kept
        return


@cache
def kind_of_cache(compilation_cache, interface: type) -> type:
    """The class of our cache, with the interface that JAX requires."""

    class Programs(interface):
        written = 0

        @property
        def _path(self) -> Path:
            return program_folder() or Path()

        def get(self, key: str) -> bytes | None:
            if chosen := self.chosen():
                return chosen.get(key)
            folder = program_folder()
            LAST.value = kept_files.read(folder / key, KIND) if folder else None
            return LAST.value

        def put(self, key: str, value: bytes) -> None:
            if chosen := self.chosen():
                chosen.put(key, value)
            elif folder := program_folder():
                LAST.value = value
                kept_files.write(folder / key, KIND, value)
                if self.written % SHARE == 0:
                    kept_files.prune(folder.parent, MOST_PROGRAMS)
                self.written += 1

        def chosen(self):
            """The cache in a folder that the user has chosen since."""
            folder = jax.config.jax_compilation_cache_dir
            return compilation_cache.get_file_cache(folder)[0] if folder else None

    return Programs


def program_folder() -> Path | None:
    """The folder of executables for this kind of processor; None if none are kept."""
    folder = cache_folder()
    return folder / PROGRAMS / processor() if folder else None


@cache
def processor() -> str:
    """Sixteen hex digits that identify this processor and its features."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:  # not Linux
        lines = []
    told = {line for line in lines if line.partition(":")[0].strip() in ("flags", "Features", "model name", "CPU part")}
    facts = (platform.system(), platform.machine(), platform.processor(), sorted(told))
    return hashlib.sha256(repr(facts).encode()).hexdigest()[:16]
