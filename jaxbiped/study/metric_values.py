"""The columns of a study's metrics, from the values that its missions kept to their ends."""

from __future__ import annotations

import warnings

import jax
import numpy as np
import polars as pl

from jaxbiped.arenas.arena import Arena
from jaxbiped.core.ready_programs import ready_jit
from jaxbiped.core.sizes import POINTS, fill, filled
from jaxbiped.jax_settings import with_own_settings
from jaxbiped.mission.batched_driver import Result, no_results
from jaxbiped.mission.metric import MissionEnd, begun, numbers_at_end
from jaxbiped.mission.oracle import OraclePlan
from jaxbiped.mission.params import MissionParams
from jaxbiped.study.batching import Group


@with_own_settings
def metric_columns(batch: Arena, group: Group, result: Result, plan: OraclePlan, size: int) -> dict[str, pl.Series]:
    """A column for each metric of a group, null where a mission has no such number; rows as those of `result`.

    A number that is NaN or infinite counts as missing, with a warning that names the metric.

    Args:
      batch: arenas [U * size] of the `U` populations, on the host.
      result: [P, count], `count` at most `size`.
      plan: [P, size].
    """
    if not group.metrics:
        return {}
    count = result.code.shape[1]
    # Padded, so that all shards of a study share one program.
    full = jax.tree.map(lambda leaf: np.pad(leaf, [(0, 0), (0, size - count)] + [(0, 0)] * (leaf.ndim - 2)), result)
    found: list = [None] * len(group.population_of)
    for population in np.unique(group.population_of):
        mine = np.flatnonzero(group.population_of == population)
        arenas = jax.tree.map(lambda leaf, at=population * size: leaf[at : at + size], batch)
        params, ends, plans = (
            jax.tree.map(lambda leaf, mine=mine: leaf[mine], tree) for tree in (group.params, full, plan)
        )
        several = filled(len(mine), POINTS)
        values = jax.device_get(at_ends(arenas, *(fill(tree, several) for tree in (params, ends, plans))))
        for row, k in enumerate(mine):
            found[k] = [(value[row, :count], valid[row, :count]) for value, valid in values]
    columns = {}
    for index, name in enumerate(group.metrics):
        value, valid = (np.concatenate([rows[index][part] for rows in found]) for part in (0, 1))
        finite = np.isfinite(value)
        if (wrong := int(np.sum(valid & ~finite))) > 0:
            warnings.warn(f"metric {name}: not finite in {wrong} of {len(value)} missions, which count as missing",
                          RuntimeWarning, stacklevel=2)  # fmt: skip
        columns[name] = pl.Series(name, np.where(finite, value, 0.0).astype(float)).to_frame().select(
            pl.when(pl.Series(valid & finite)).then(pl.col(name)).alias(name)
        )[name]  # fmt: skip
    return columns


@with_own_settings
def check_metrics(batch: Arena, group: Group, size: int) -> None:
    """Check what metrics return before a mission is played for them; arguments as for `metric_columns`.

    Raises:
      InputError: a metric whose result is not one number and one boolean.
    """
    if not group.metrics:
        return
    arenas = jax.tree.map(lambda leaf: leaf[:size], batch)
    params = jax.tree.map(lambda leaf: leaf[:1], group.params)
    kind = jax.tree.structure((arenas, params)), *(np.shape(leaf) for leaf in jax.tree.leaves((arenas, params)))
    if kind in CHECKED:
        return
    one = (jax.tree.map(lambda leaf: leaf[0], tree) for tree in (arenas, params))
    states = jax.eval_shape(lambda arena, params: begun(params.metrics, arena, params), *one)
    plan = OraclePlan(np.zeros((1, size), bool), *(np.zeros((1, size), np.float32) for _ in range(2)))
    jax.eval_shape(at_ends, arenas, params, no_results(1, size, metrics=states), plan)
    CHECKED.add(kind)


CHECKED: set = set()  # structures and shapes that have been checked


@ready_jit
def at_ends(arenas: Arena, params: MissionParams, results: Result, plans: OraclePlan) -> tuple:
    """(value, valid) [P, A] of each metric."""

    def one(arena: Arena, params: MissionParams, result: Result, plan: OraclePlan) -> tuple:
        return numbers_at_end(params.metrics, result.metrics, MissionEnd(arena, result, plan, params))

    over_arenas = jax.vmap(one, in_axes=(0, None, 0, 0))
    return jax.vmap(over_arenas, in_axes=(None, 0, 0, 0))(arenas, params, results, plans)
