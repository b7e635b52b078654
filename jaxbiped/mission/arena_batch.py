"""Arenas of a population, and the seeds of their missions."""

from __future__ import annotations

import jax
from jaxtyping import Array, Int, PRNGKeyArray, UInt32

from jaxbiped.arenas.arena import Arena
from jaxbiped.arenas.population import Population
from jaxbiped.arenas.source import OwnFamily, draw_arena
from jaxbiped.core.ready_programs import ready_jit
from jaxbiped.jax_settings import with_own_settings
from jaxbiped.sensing.counter_rng import from_key

NOISE = 1  # fold_in of an arena's key, for the noise of its missions


@with_own_settings
@ready_jit(static_argnames=("families",))
def draw(
    key: PRNGKeyArray,
    index: Int[Array, "A"],
    families: tuple[str | OwnFamily, ...],
    populations: Population | None = None,
    turns: Int[Array, "A"] | None = None,
) -> tuple[Arena, UInt32[Array, "A"]]:
    """Arenas `index` of the population, and the seeds of their missions' noise: the same for all strategies.

    Args:
      populations: leaves [U]; the result then holds the arenas of each population in turn: [U * A].
      turns: index of the family of each arena; by default its number modulo their number.
    """

    def one(population: Population | None) -> Arena:
        if turns is None:
            return jax.vmap(lambda k: draw_arena(key, k, families, population))(index)
        return jax.vmap(lambda k, turn: draw_arena(key, k, families, population, turn))(index, turns)

    if populations is None:
        batch = one(None)
    else:
        batch = jax.tree.map(lambda leaf: leaf.reshape(-1, *leaf.shape[2:]), jax.vmap(one)(populations))
    seeds = jax.vmap(lambda k: from_key(jax.random.fold_in(jax.random.fold_in(key, k), NOISE)))(index)
    return batch, seeds
