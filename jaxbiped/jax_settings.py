"""Our own settings of JAX, whatever those of the process are that calls us.

All arithmetic here is in single precision, and the numbers of a seed are those of one generator. A script that turned
`jax_enable_x64` on for its own sake, or any of the settings below, gets the same results from us as without.
"""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable
from typing import Any, TypeVar

import jax
import numpy as np

from jaxbiped.core.program_cache import keep_programs

SETTINGS = (
    (jax.enable_x64, False),
    (jax.numpy_rank_promotion, "allow"),
    (jax.numpy_dtype_promotion, "standard"),
    (jax.default_matmul_precision, None),
    (jax.threefry_partitionable, True),
    (jax.default_prng_impl, "threefry2x32"),
    (jax.debug_nans, False),  # NaN and infinity mean something to us
    (jax.debug_infs, False),
)
NARROW = {np.dtype(name + "64"): np.dtype(name + "32") for name in ("float", "int", "uint")}

F = TypeVar("F", bound=Callable[..., Any])

keep_programs()


@contextlib.contextmanager
def own_settings():
    """JAX's defaults, in this thread; entering them where they hold already costs microseconds and compiles nothing."""
    with contextlib.ExitStack() as stack:
        for setting, value in SETTINGS:
            stack.enter_context(setting(value))
        yield


def with_own_settings(function: F) -> F:
    """Decorator: call in `own_settings`, with arrays of 64 bits among the arguments cut to 32."""

    @functools.wraps(function)
    def call(*args, **kwargs):
        if jax.config.jax_enable_x64:
            args, kwargs = jax.tree.map(narrow, (args, kwargs))
        with own_settings():
            return function(*args, **kwargs)

    return call


def narrow(leaf: Any) -> Any:
    """A number or an array in 32 bits; anything else as it is."""
    kind = NARROW.get(getattr(leaf, "dtype", None))
    return leaf if kind is None else leaf.astype(kind)
