"""Compiled programs on disk, found without tracing them: the second process to run a program loads it in milliseconds.

XLA's own cache (`core.program_cache`) is keyed by the lowered program, and tracing and lowering take seconds. Here
the key is what a program is traced from: the text of this package, its function, static values, the shapes and types
of its arguments, JAX's settings, the versions of JAX and XLA and the kind of processor. So it is used only where that
is sufficient: on one device of one process, outside of other traces, if every type of the arguments and everything
static is from this package or plain, and if nobody has replaced anything in a module or a class of it, or edited its
files since they were read. Tables that are modified in place are not detected: use `JAXBIPED_CACHE=off` then. Programs
that call back into Python are traced again, since their functions are identified by numbers of one process. `jax.jit`
is used in all other cases. A kept program is executable code: the folder must be the user's own, as it is by default.
"""

from __future__ import annotations

import functools
import importlib
import inspect
import io
import pickle
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
from jax._src import compilation_cache
from jax._src.lib import xla_client
from jax.experimental import serialize_executable

from jaxbiped.core import kept_files
from jaxbiped.core.cache_location import MOST_PROGRAMS
from jaxbiped.core.lazy_loading import REPLACED
from jaxbiped.core.program_cache import LAST, program_folder
from jaxbiped.core.program_identity import compile_settings, has_one_device, program_key, trace_settings

KIND = b"jaxbiped ready program 1\n"

Target = tuple[str, tuple]  # a module, and the arguments of its `registered`
TARGETS: dict[str, Target] = {}  # by the names of kernels in XLA
CALLED = re.compile(r'custom_call_target="([^"]+)"')


def ready_jit(function: Callable | None = None, *, static_argnames: tuple[str, ...] = ()) -> Callable:
    """Decorator: `jax.jit`, with programs kept on disk."""
    if function is None:
        return functools.partial(ready_jit, static_argnames=static_argnames)
    signature = inspect.signature(function)
    traced = tuple(name for name in signature.parameters if name not in static_argnames)
    programs: dict[Any, Callable] = {}
    jitted = jax.jit(function, static_argnames=static_argnames)

    def from_parts(arguments: tuple, static: tuple):
        return function(**dict(zip(traced, arguments, strict=True)), **dict(static))

    from_parts.__name__ = from_parts.__qualname__ = function.__name__  # it names the program
    apart = jax.jit(from_parts, static_argnums=1)

    @functools.wraps(function)
    def call(*args, **kwargs):
        bound = signature.bind(*args, **kwargs)
        bound.apply_defaults()
        arguments = tuple(bound.arguments[name] for name in traced)
        static = tuple((name, bound.arguments[name]) for name in static_argnames)
        leaves, tree = jax.tree.flatten(arguments)
        if not may_be_ready(leaves):
            return jitted(*args, **kwargs)
        try:
            kinds = tuple(map(jax.typeof, leaves))
        except TypeError:  # for example, numbers of another byte order
            return jitted(*args, **kwargs)
        key = tree, static, tuple(type(value) for _, value in static), kinds, trace_settings(), compile_settings()
        program = programs.get(key)
        if program is None:
            name = f"{function.__module__}.{function.__qualname__}"
            program = programs[key] = ready(name, (arguments,), static, lambda: apart.lower(arguments, static))
        return program(arguments)

    call.lower = jitted.lower
    return call


def ready(
    name: str,
    arguments: tuple,
    static: Any,
    lower: Callable[[], jax.stages.Lowered],
    compile: Callable[[jax.stages.Lowered], jax.stages.Compiled] = lambda lowered: lowered.compile(),
) -> jax.stages.Compiled:
    """A compiled program, loaded from disk if it is there, else compiled, and kept if possible.

    Args:
      name: name of the traced function, with everything that is not in the other arguments.
      arguments: positional arguments of the program: arrays, or anything with a shape and type.
      static: everything else that the program depends on.
      lower, compile: make it.
    """
    file = program_file(name, arguments, static)
    if file is None:
        return compile(lower())
    found = load(file, arguments)
    if found is None:
        lowered, LAST.value = lower(), None
        found = compile(lowered)
        store(file, found, LAST.value)
    return found


def may_be_ready(leaves: list) -> bool:
    """Whether arguments are arrays on the only device, or numbers, and nothing of this package was replaced."""
    if REPLACED:  # after that the user may want programs traced again, by `jax.clear_caches`
        return False
    if jax.config.jax_disable_jit or not has_one_device():
        return False
    if any(isinstance(leaf, jax.core.Tracer) for leaf in leaves):
        return False
    if jax.default_backend() == "cpu":
        return True  # there is no other device
    device = {jax.local_devices()[0]}
    return all(leaf.devices() == device for leaf in leaves if isinstance(leaf, jax.Array))


def program_file(name: str, arguments: tuple, static: Any) -> Path | None:
    """The file of a program; None if it is not kept."""
    folder = program_folder()
    if folder is None or not jax.config.jax_enable_compilation_cache or jax.config.jax_compilation_cache_dir:
        return None
    key = program_key(name, arguments, static)
    return folder / f"ready-{key}" if key else None


def load(file: Path, arguments: tuple) -> jax.stages.Compiled | None:
    """A kept program; None if there is none, or it cannot be used."""
    data = kept_files.read(file, KIND)
    if data is None:
        return None
    try:
        payload, skeleton, targets = pickle.loads(data)
        for module, given in targets:
            importlib.import_module(module).registered(*given)
        trees = jax.tree.structure((arguments, {})), jax.tree.structure(skeleton)
        return serialize_executable.deserialize_and_load(payload, *trees)
    except Exception:  # of any kind: the program is compiled again, and this file replaced
        return None


def store(file: Path, program: jax.stages.Compiled, kept: bytes | None = None) -> None:
    """Keep a program, if possible.

    Args:
      kept: its entry in JAX's cache. One that came from there cannot be written again: XLA omits a part.
    """
    called = set(CALLED.findall(program.as_text() or ""))
    if not called <= set(TARGETS):  # Python functions, or libraries that are initialised when a program is traced
        return
    try:
        tree = program.out_tree
        skeleton = jax.tree.unflatten(tree, range(tree.num_leaves))
        targets = [TARGETS[name] for name in sorted(called)]
        data = pickle.dumps((written(program, kept), skeleton, targets), protocol=5)
    except Exception:  # a program, or results, of a kind that cannot be kept
        return
    kept_files.write(file, KIND, data)
    kept_files.prune(file.parent.parent, MOST_PROGRAMS)


def written(program: jax.stages.Compiled, kept: bytes | None) -> bytes:
    """As `serialize_executable.serialize`, from the entry in JAX's cache if there is one."""
    if kept is None:
        return serialize_executable.serialize(program)[0]
    code, _ = compilation_cache.extract_executable_and_time(compilation_cache.decompress_executable(kept))

    class Pickler(serialize_executable._JaxPjrtPickler):
        def persistent_id(self, thing):
            return ("exec", code) if isinstance(thing, xla_client.LoadedExecutable) else super().persistent_id(thing)

    with io.BytesIO() as file:
        unloaded = program._executable._unloaded_executable
        Pickler(file).dump((unloaded, jax.tree.leaves(program.args_info), program._no_kwargs))
        return file.getvalue()
