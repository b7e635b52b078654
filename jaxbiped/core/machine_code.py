"""Machine code of kernels on disk: what Numba compiled once, the next process loads, in milliseconds.

Numba's own cache cannot keep most of these kernels: they are closures over instructions made at run time, which it
cannot tell apart. But all that they are made of is known: the sources of `planning` and `mapping`, the versions of
Python, Numba and LLVM, and the kind of processor. A hash of these is the key: a changed program is never loaded.

A file that is damaged, cut short or not readable is compiled anew; a folder that cannot be written to is done without.
"""

from __future__ import annotations

import contextlib
import hashlib
import platform
import sys
from functools import cache
from pathlib import Path

import llvmlite
import llvmlite.binding as llvm
import numba
from numba.core.registry import cpu_target
from numba.core.runtime import rtsys

from jaxbiped.core import kept_files
from jaxbiped.core.cache_location import KERNELS, cache_folder

PACKAGE = Path(__file__).parents[1]
SOURCES = tuple(PACKAGE / source for source in ("planning", "mapping", "core/xla_ffi.py"))  # what kernels are made of
MAGIC = b"jaxbiped kernel 1\n"
OLDEST = 8  # versions of the program whose kernels are kept


def load(name: str) -> int | None:
    """The address of the C function `name` of an earlier process; None where none is kept."""
    folder = kernel_folder()
    rest = kept_files.read(folder / name, MAGIC) if folder else None
    if rest is None:
        return None
    symbol, _, machine_code = rest.partition(b"\n")
    rtsys.initialize(cpu_target.target_context)  # what machine code allocates memory by; compiling would do so, too
    engine().add_object_file(llvm.ObjectFileRef.from_data(machine_code))
    engine().finalize_object()
    return engine().get_function_address(symbol.decode()) or None


def store(name: str, handler) -> None:
    """Keep what `numba.cfunc` compiled, where that is possible."""
    folder = kernel_folder()
    if folder is None:
        return
    with contextlib.suppress(OSError, AttributeError):  # a Numba that is built otherwise inside keeps nothing
        library = handler._library
        machine_code = library.codegen._tm.emit_object(library._final_module)
        rest = handler.native_name.encode() + b"\n" + machine_code
        if kept_files.write(folder / name, MAGIC, rest):
            sweep_up(folder.parent)


def sweep_up(parent: Path) -> None:
    """Remove the kernels of all but the last few versions."""
    folders = sorted((f for f in parent.iterdir() if f.is_dir()), key=lambda f: f.stat().st_mtime, reverse=True)
    for old in folders[OLDEST:]:
        for file in old.iterdir():
            file.unlink(missing_ok=True)
        old.rmdir()


def kernel_folder() -> Path | None:
    """The folder of this program's kernels on this kind of processor; None where none are kept."""
    folder = cache_folder()
    try:
        return folder / KERNELS / key() if folder else None
    except OSError:  # sources that cannot be read
        return None


@cache
def key() -> str:
    """Sixteen hex digits of all that kernels are made of."""
    made = hashlib.sha256()
    files = sorted(f for source in SOURCES for f in (source.rglob("*.py") if source.is_dir() else [source]))
    for file in files:
        made.update(file.name.encode() + b"\0" + file.read_bytes() + b"\0")
    facts = (
        sys.version,
        numba.__version__,
        llvmlite.__version__,
        platform.machine(),
        *cpu_target.target_context.codegen().magic_tuple(),
        *(getattr(numba.config, name, None) for name in ("OPT", "BOUNDSCHECK", "LOOP_VECTORIZE")),
    )
    made.update(repr(facts).encode())
    return made.hexdigest()[:16]


@cache
def engine():
    """Where machine code is loaded to; it stays as long as the process."""
    target = llvm.Target.from_default_triple()
    machine = target.create_target_machine(
        opt=2, reloc="default" if sys.platform.startswith("win") else "pic", jit=True
    )
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
