"""Straight to the goal, and along what is in the way with the right hand on it: Bug2, with a memory, in JAX."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp

import jaxbiped as jb

MOVES = jnp.asarray(jb.DIRECTIONS)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class WallFollower(jb.Planner):
    """Follows a wall until it is nearer to the goal than where it met it, and can go on straight."""

    nearer: float = 1.0  # [cells] by which it must be nearer before it leaves a wall

    def initial_state(self, shape):
        """Whether it follows a wall, how far from the goal it met it [cells], and which way it went last."""
        return jnp.zeros((), bool), jnp.zeros(()), jnp.zeros((), jnp.int32)

    def plan(self, problem):
        """One move."""
        following, met, last = problem.state
        free = jnp.isfinite(jb.GridPlanner().edge_costs(problem))
        free = free[:, problem.start_ij[0], problem.start_ij[1]]
        away = (problem.goal_ij - problem.start_ij).astype(jnp.float32)
        straight = jnp.argmin(jnp.hypot(*(away[:, None] - MOVES.T)))
        distance = jnp.hypot(away[0], away[1])
        leaves = following & free[straight] & (distance < met - self.nearer)
        begins = ~following & ~free[straight]
        met = jnp.where(begins, distance, met)
        last = jnp.where(begins, straight, last)
        following = (following & ~leaves) | begins
        turns = (last + jnp.array([-2, -1, 0, 1, 2, 3, 4, -3])) % 8  # to the right first: its hand stays on the wall
        turns = jnp.where(begins, (straight + jnp.arange(8)) % 8, turns)
        along = turns[jnp.argmax(free[turns])]
        k = jnp.where(following, along, straight)
        move = jnp.where(jnp.any(free) & (distance > 0), k, -1).astype(jnp.int8)
        rest = jnp.full(problem.length - 1, -1, jnp.int8)
        return jb.Route(jnp.concatenate([move[None], rest]), state=(following, met, k.astype(jnp.int32)))
