"""Work shared out among the devices of this process."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Hashable, Sequence
from functools import lru_cache, partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec

AXIS = "device"
EACH, ALL = PartitionSpec(AXIS), PartitionSpec()  # a row or rows of the leading axis for each device; the same for all


def cores() -> int:
    """Cores that this process may use: those of its affinity, where the system has one (macOS has none), and no more
    than its control group's share of their time, where it has one."""
    known = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(known, share_of_cores()))


def share_of_cores(file: str = "/sys/fs/cgroup/cpu.max") -> int:
    """Cores, rounded up, whose time the control group may have."""
    try:
        quota, period = Path(file).read_text().split()
        return -(-int(quota) // int(period))
    except (OSError, ValueError, ZeroDivisionError):  # there is none, or "max"
        return sys.maxsize


def mesh_of(devices: Sequence[jax.Device]) -> Mesh:
    """Devices in a row."""
    return Mesh(np.array(devices), (AXIS,))


def placed(tree, mesh: Mesh, spec: PartitionSpec):
    """The leaves of a pytree on the devices that want them."""
    return jax.device_put(tree, NamedSharding(mesh, spec))


def on_each(function: Callable, mesh: Mesh, specs: tuple[PartitionSpec, ...], out: PartitionSpec = EACH, **options):
    """`function` compiled once and run by each device on its part of the arguments, and on nothing else.

    The devices never wait for each other inside: a loop ends on each of them when its own part is done.

    Args:
      specs: of each argument; out: of the result.
      options: of `jax.jit`.
    """
    spread = jax.shard_map(function, mesh=mesh, in_specs=specs, out_specs=out, check_vma=False)
    places = tuple(NamedSharding(mesh, spec) for spec in specs)
    return jax.jit(spread, in_shardings=places, out_shardings=NamedSharding(mesh, out), **options)


def by_rows(function: Callable, mesh: Mesh, *, shared: int = 0, axis: int = 0, **static: Hashable) -> Callable:
    """A function of a batch, leaves [B, ...], with its rows in equal parts on all devices. No result depends on others.

    Args:
      function: of the batch, then of what is the same for all; module-level or cached, it is compiled once.
      shared: how many arguments there are after the first.
      axis: of the batch in the results.
      static: further arguments, by name.
    """
    spread = compiled_by_rows(function, mesh, shared, axis, tuple(static.items()))

    def call(batch, *others):
        count = jax.tree.leaves(batch)[0].shape[0]
        more = -count % mesh.size
        if more:  # copies of the last row
            batch = jax.tree.map(lambda leaf: jnp.pad(leaf, ((0, more), *[(0, 0)] * (leaf.ndim - 1)), "edge"), batch)
        result = spread(placed(batch, mesh, EACH), *placed(others, mesh, ALL))
        return jax.tree.map(lambda leaf: jax.lax.slice_in_dim(leaf, 0, count, axis=axis), result) if more else result

    return call


@lru_cache(maxsize=64)
def compiled_by_rows(function: Callable, mesh: Mesh, shared: int, axis: int, static: tuple) -> Callable:
    """Made once, so that the same function is not compiled again."""
    out = PartitionSpec(*[None] * axis, AXIS)
    return on_each(partial(function, **dict(static)), mesh, (EACH, *[ALL] * shared), out)
