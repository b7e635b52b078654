"""The strategies that are compared (paper, Table 1): what a robot dares to step on."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool

from jaxbiped.mission.config import STRATEGIES as STRATEGIES
from jaxbiped.planning import Rules


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Strategy:
    """One row of Table 1, traced: missions of different strategies share one compiled program."""

    bumps: Bool[Array, "*B"]  # steps over bumps; else they are obstacles
    gates: Bool[Array, "*B"]  # passes gates; else they are obstacles
    blind: Bool[Array, "*B"]  # walks straight to the goal, and stops at what is no floor
    corner_cutting: Bool[Array, "*B"]

    def rules(self) -> Rules:
        """For the planner."""
        return Rules(corner_cutting=self.corner_cutting, bumps=self.bumps, gates=self.gates)


def strategy(name: str, corner_cutting: bool = False) -> Strategy:
    """The strategy called `name`; KeyError where there is none."""
    bumps, gates, blind = STRATEGIES[name]
    return Strategy(*(jnp.asarray(flag) for flag in (bumps, gates, blind, corner_cutting)))
