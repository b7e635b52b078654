"""Calls of Python functions from inside compiled programs, on a CPU without any involvement of JAX.

`jax.pure_callback` passes arrays that JAX creates while it waits for the program, which can deadlock if all threads of
the device are busy. Here XLA calls a C function of ours through its foreign function interface (see
`core.xla_ffi`), which wraps the memory itself as NumPy arrays. On other devices it is
`jax.pure_callback`.
"""

from __future__ import annotations

import ctypes
import itertools
import traceback
from collections.abc import Callable, Sequence
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np

NAME = "jaxbiped_host_call"
# Offsets of the fields, in words of 8 bytes from the beginning of their structure; as in `core.xla_ffi`.
FRAME_EXTENSION, FRAME_ARGUMENT_COUNT, FRAME_ARGUMENTS, FRAME_RESULT_COUNT, FRAME_RESULTS = 1, 7, 9, 12, 14
BUFFER_DTYPE, BUFFER_DATA, BUFFER_RANK, BUFFER_SHAPE = 2, 3, 4, 5
EXTENSION_TYPE, EXTENSION_METADATA, METADATA_VERSION, METADATA = 1, 3, 3, 1
VERSION = 1 << 32  # major 0 in the lower half of the word, minor 1 in the upper
# XLA's types, those that are used, as NumPy writes them.
DTYPES = {
    code: np.dtype(name).str for code, name in {1: "?", 2: "int8", 4: "int32", 8: "uint32", 11: "float32"}.items()
}

Function = Callable[..., Sequence[np.ndarray]]
FUNCTIONS: dict[int, Function] = {}
NUMBERS = itertools.count()


def host_call(
    function: Function, results: Sequence[jax.ShapeDtypeStruct], *arguments: jax.Array, vmap_method: str | None = None
) -> list[jax.Array]:
    """`function(*arguments)`, called on the host with NumPy arrays that it must not keep, once for the whole batch.

    Args:
      function: returns arrays that match `results`; must not raise.
      results, arguments: bool, int8, int32, uint32 or float32.
      vmap_method: as for `jax.pure_callback`; by default `jax.vmap` of it is an error.
    """
    number = next((n for n, known in FUNCTIONS.items() if known is function), None)
    if number is None:
        number = next(NUMBERS)
        FUNCTIONS[number] = function

    def on_cpu(*arguments):
        register()
        call = jax.ffi.ffi_call(NAME, list(results), has_side_effect=True, vmap_method=vmap_method)
        return call(jnp.int32(number), *arguments)

    def elsewhere(*arguments):
        return list(jax.pure_callback(function, list(results), *arguments, vmap_method=vmap_method))

    return jax.lax.platform_dependent(*arguments, cpu=on_cpu, default=elsewhere)


@cache
def register() -> None:
    """Tell XLA the address of `handler`."""
    new = ctypes.pythonapi.PyCapsule_New
    new.restype, new.argtypes = ctypes.py_object, (ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p)
    address = ctypes.cast(handler, ctypes.c_void_p).value
    jax.ffi.register_ffi_target(NAME, new(address, None, None), platform="cpu")


@cache  # ctypes forgets a type that nothing refers to, and creating one takes longer than reading it
def words_type(count: int) -> type:
    """The type of an array of words of 8 bytes."""
    return ctypes.c_uint64 * count


def words(address: int, count: int):
    """Words of 8 bytes at an address, as Python numbers."""
    return words_type(count).from_address(address)


class Memory:
    """Foreign memory that NumPy can wrap."""

    def __init__(self, address: int, shape: tuple[int, ...], dtype: str) -> None:
        self.__array_interface__ = {"data": (address, False), "shape": shape, "typestr": dtype, "version": 3}


def array(buffer: int) -> np.ndarray:
    """The array in an XLA buffer, without a copy."""
    fields = words(buffer, BUFFER_SHAPE + 1)
    rank = fields[BUFFER_RANK]
    shape = tuple(words(fields[BUFFER_SHAPE], rank)) if rank else ()
    dtype = DTYPES[fields[BUFFER_DTYPE] & 0xFFFFFFFF]
    if 0 in shape:  # its address may be null
        return np.zeros(shape, dtype)
    return np.asarray(Memory(fields[BUFFER_DATA], shape, dtype))


@ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p)
def handler(address):
    """The function that XLA calls with the address of a call frame."""
    frame = words(address, FRAME_RESULTS + 1)
    if frame[FRAME_EXTENSION]:
        extension = words(frame[FRAME_EXTENSION], EXTENSION_METADATA + 1)
        if extension[EXTENSION_TYPE] & 0xFFFFFFFF == METADATA:
            words(extension[EXTENSION_METADATA], METADATA_VERSION + 1)[METADATA_VERSION] = VERSION
            return None
    try:
        number, *arguments = map(array, words(frame[FRAME_ARGUMENTS], frame[FRAME_ARGUMENT_COUNT]))
        outs = [array(buffer) for buffer in words(frame[FRAME_RESULTS], frame[FRAME_RESULT_COUNT])]
        for out in outs:
            out[...] = 0  # the result if the function fails
        for out, made in zip(outs, FUNCTIONS[int(number.flat[0])](*arguments), strict=True):
            out[...] = made
    except BaseException:  # nothing could catch it
        traceback.print_exc()
    return None
