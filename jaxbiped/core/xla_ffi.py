"""Functions compiled by Numba, called from XLA programs on a CPU through XLA's foreign function interface.

XLA calls a function with one structure, the call frame, which holds the addresses of its arguments and results. That
layout is a stable binary interface, kept for at least twelve months (`xla/ffi/api/c_api.h`, shipped with jaxlib in
`jax.ffi.include_dir()`); the few fields read here have lain where they lie since its version 0.1.
"""

from __future__ import annotations

import ctypes
import threading

import jax
import numpy as np
from numba import carray, cfunc, config, njit, types
from numba.extending import intrinsic

from jaxbiped.core import machine_code
from jaxbiped.errors import InputError

if config.DISABLE_JIT:  # the command line overrides it; a script's own setting is not ours to change
    raise InputError("must be 0 or unset: planners and maps are compiled by Numba", field="NUMBA_DISABLE_JIT", value=1)

# Places of the fields, in words of 8 bytes from the beginning of their structure.
FRAME_EXTENSION, FRAME_ARGUMENT_COUNT, FRAME_ARGUMENTS, FRAME_RESULTS = 1, 7, 9, 14
BUFFER_DATA, BUFFER_RANK, BUFFER_SHAPE = 3, 4, 5
EXTENSION_TYPE, EXTENSION_METADATA, METADATA_VERSION = 1, 3, 3
# Functions that only each other call: wrappers for Python would take half the time to compile.
compiled = njit(nogil=True, error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)
METADATA = 1  # type of the extension with which XLA asks for which version of the interface a function was written
VERSION = np.uint64(1 << 32)  # major 0 in the lower half of the word, minor 1 in the upper


@intrinsic
def pointer(context, address):
    """An address as a pointer."""

    def generate(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], context.get_value_type(types.voidptr))

    return types.voidptr(types.uint64), generate


@compiled
def words(address, count):
    """The `count` words of 8 bytes at an address."""
    return carray(pointer(address), (count,), np.uint64)


@compiled
def data(buffers, k):
    """The address of the elements of buffer number `k` of the list of buffers at address `buffers`."""
    return words(words(buffers, k + 1)[k], BUFFER_DATA + 1)[BUFFER_DATA]


@compiled
def array(buffers, k, size, dtype):
    """The first `size` elements of buffer number `k`, flat."""
    return carray(pointer(data(buffers, k)), (size,), dtype)


@compiled
def shape(buffers, k):
    """Its sizes along its axes, as many of the words as it has axes."""
    return words(words(words(buffers, k + 1)[k], BUFFER_SHAPE + 1)[BUFFER_SHAPE], 8)


@compiled
def rank(buffers, k):
    """The number of its axes."""
    return np.int64(words(words(buffers, k + 1)[k], BUFFER_RANK + 1)[BUFFER_RANK])


@compiled
def answered(frame):
    """Whether this call only asked for the version of the interface, which is now told."""
    if frame[FRAME_EXTENSION] == 0:
        return False
    extension = words(frame[FRAME_EXTENSION], EXTENSION_METADATA + 1)
    if extension[EXTENSION_TYPE] & np.uint64(0xFFFFFFFF) != METADATA:
        return False
    words(extension[EXTENSION_METADATA], METADATA_VERSION + 1)[METADATA_VERSION] = VERSION
    return True


def expect(array, shape: tuple[int, ...], dtype) -> None:
    """Refuse what a kernel would read wrongly, or beyond its end: kernels do not look at what they are given."""
    if tuple(array.shape) != tuple(shape) or array.dtype != dtype:
        raise ValueError(f"a kernel wants {np.dtype(dtype).name} {list(shape)}, not {array.dtype} {list(array.shape)}")


def register(name: str, function, *, keep: bool = False) -> None:
    """Make `function(arguments, count, results)`, a Numba function, callable as `jax.ffi.ffi_call(name, ...)`, once.

    It gets the addresses of the lists of its arguments and results, for `data` and `shape`, and the number of its
    arguments. It must not raise: there is nobody to catch.

    Args:
      keep: on disk, as the one function of this name (`core.machine_code`).
    """
    new = ctypes.pythonapi.PyCapsule_New
    new.restype, new.argtypes = ctypes.py_object, (ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p)
    with LOCK:  # threads that trace, and those that load programs from the disk
        if name not in ADDRESSES:
            capsule = new(compile_handler(name, function, keep), None, None)
            jax.ffi.register_ffi_target(name, capsule, platform="cpu")


def compile_handler(name: str, function, keep: bool) -> int:
    """The address of the function that XLA is to call, from the disk where it is kept there; for `call` as well."""
    address = machine_code.load(name) if keep else None
    if address is None:

        @cfunc(types.uint64(types.CPointer(types.uint64)))
        def handler(call):
            frame = carray(call, (FRAME_RESULTS + 1,))
            if not answered(frame):
                function(frame[FRAME_ARGUMENTS], frame[FRAME_ARGUMENT_COUNT], frame[FRAME_RESULTS])
            return 0  # no error

        HANDLERS[name] = handler  # kept: XLA holds its address
        address = handler.address
        if keep:
            machine_code.store(name, handler)
    ADDRESSES[name] = address
    return address


LOCK = threading.RLock()
HANDLERS: dict = {}
ADDRESSES: dict = {}
CALL = ctypes.CFUNCTYPE(ctypes.c_uint64, ctypes.c_void_p)


def call(name: str, arguments, results) -> None:
    """Call a compiled function as XLA would, with contiguous NumPy arrays. Other threads run meanwhile."""

    def listed(arrays):
        shapes = [np.array(array.shape, np.int64) for array in arrays]
        buffers = np.zeros((len(arrays), BUFFER_SHAPE + 1), np.uint64)
        buffers[:, BUFFER_DATA] = [array.ctypes.data for array in arrays]
        buffers[:, BUFFER_RANK] = [array.ndim for array in arrays]
        buffers[:, BUFFER_SHAPE] = [shape.ctypes.data for shape in shapes]
        return [buffer.ctypes.data for buffer in buffers], (shapes, buffers)

    given, held = listed(arguments)
    made, held_too = listed(results)
    given, made = np.array(given, np.uint64), np.array(made, np.uint64)
    frame = np.zeros(FRAME_RESULTS + 1, np.uint64)
    frame[FRAME_ARGUMENTS], frame[FRAME_RESULTS] = given.ctypes.data, made.ctypes.data
    frame[FRAME_ARGUMENT_COUNT] = len(arguments)
    CALL(ADDRESSES[name])(frame.ctypes.data)
    del held, held_too  # until here they must live
