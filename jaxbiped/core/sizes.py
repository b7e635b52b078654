"""Sizes for which programs are compiled: few of them, so that studies of many sizes share programs."""

from __future__ import annotations

import jax
import numpy as np

ARENAS, POINTS, JOBS = 16, 8, 64  # smallest sizes of programs


def filled(count: int, least: int) -> int:
    """The next power of two not below `count`, at least `least`."""
    return max(least, 1 << max(count - 1, 0).bit_length())


def fill(tree, count: int):
    """The leaves [n, ...] of a pytree on the host, padded with their last row to `count` rows."""

    def grow(leaf):
        leaf = np.asarray(leaf)
        return leaf[np.minimum(np.arange(count), leaf.shape[0] - 1)]

    return jax.tree.map(grow, tree)


def fill_up(tree, least: int):
    """The leaves with as many rows as a program is compiled for, on the host."""
    return fill(tree, filled(jax.tree.leaves(tree)[0].shape[0], least))
