"""Batches of any rank, `vmap` and `grad` for functions that are written for one leading batch axis."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped.errors import InputError


def fold(array: np.ndarray | jax.Array, batch: tuple[int, ...], core: int) -> np.ndarray | jax.Array:
    """An array broadcast to the leading axes `batch`, which become one; its last `core` axes are unchanged.

    NumPy arrays stay NumPy arrays, so that nothing is copied to a device too early.
    """
    numpy = np if isinstance(array, np.ndarray) else jnp
    ends = array.shape[array.ndim - core :]
    if array.shape != batch + ends:
        array = numpy.broadcast_to(array, batch + ends)
    return array if len(batch) == 1 else array.reshape(math.prod(batch), *ends)


def unfold(tree, batch: tuple[int, ...]):
    """Leaves [B, ...] with their first axis split into those of `batch`: the inverse of `fold`."""
    if len(batch) == 1:
        return tree
    return jax.tree.map(lambda leaf: leaf.reshape(*batch, *leaf.shape[1:]), tree)


def folding_vmap(function: Callable) -> Callable:
    """`function` of pytrees with the batch axis first, for which `vmap` extends that batch.

    For functions that call a compiled kernel, which has a fixed rank. Results must have the batch first, too, and an
    arena's result must not depend on the others of its batch.
    """
    folded = jax.custom_batching.custom_vmap(function)

    @folded.def_vmap
    def rule(size, batched, *arguments):
        def whole(leaf, has_axis):
            leaf = leaf if has_axis else jnp.broadcast_to(leaf, (size, *leaf.shape))
            return leaf.reshape(size * leaf.shape[1], *leaf.shape[2:])

        out = folded(*jax.tree.map(whole, arguments, tuple(batched)))
        out = jax.tree.map(lambda leaf: leaf.reshape(size, leaf.shape[0] // size, *leaf.shape[1:]), out)
        return out, jax.tree.map(lambda _: True, out)

    return folded


def by_batch_size(few: Callable, many: Callable, least: int) -> Callable:
    """`few`, which becomes `many` where `vmap` maps it over at least `least`; both return the same, bit for bit.

    For functions of which the second is faster but takes longer to compile. Only the innermost `vmap` counts: one over
    100 of one over 4 is 400 times `few`.
    """
    chosen = jax.custom_batching.custom_vmap(few)

    @chosen.def_vmap
    def rule(size, batched, *arguments):
        axes = jax.tree.map(lambda has_axis: 0 if has_axis else None, tuple(batched))
        out = jax.vmap(many if size >= least else few, in_axes=axes)(*arguments)
        return out, jax.tree.map(lambda _: True, out)

    return chosen


def by_platform(on_cpu: Callable, elsewhere: Callable) -> Callable:
    """`on_cpu` in programs that are lowered for a CPU, else `elsewhere`; both return the same.

    Where this process has another device, `on_cpu` is not even traced: it may compile for seconds.
    """
    if jax.default_backend() != "cpu":
        return elsewhere
    return partial(jax.lax.platform_dependent, cpu=on_cpu, default=elsewhere)


def without_gradient(function: Callable, instead: str) -> Callable:
    """`function`, with an error that names an alternative if it is differentiated.

    If it is only part of a program that is differentiated with respect to other inputs, its gradient is zero.
    """
    guarded = jax.custom_jvp(function)

    @partial(guarded.defjvp, symbolic_zeros=True)
    def rule(primals, tangents):
        if not all(isinstance(leaf, jax.custom_derivatives.SymbolicZero) for leaf in jax.tree.leaves(tangents)):
            raise InputError(instead)
        out = guarded(*primals)
        return out, jax.tree.map(_zero_tangent, out)

    return guarded


def _zero_tangent(leaf):
    if jnp.issubdtype(leaf.dtype, jnp.floating):
        return jnp.zeros_like(leaf)
    return np.zeros(leaf.shape, jax.dtypes.float0)
