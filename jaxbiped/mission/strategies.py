"""Strategies: what a robot plans with, and what it may step on (paper, Table 1)."""

from __future__ import annotations

import re
from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool

from jaxbiped.core.component import check_component
from jaxbiped.core.registry import STRATEGIES
from jaxbiped.errors import InputError
from jaxbiped.planning import Rules
from jaxbiped.planning.planners import Planner

NAME = re.compile(r"[A-Za-z][\w .+-]{0,39}")  # shown in tables, figures and pages


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class StrategyFlags:
    """What a strategy may cross, traced: missions of different strategies share one compiled program."""

    bumps: Bool[Array, "*B"]  # steps over bumps; else they are obstacles
    gates: Bool[Array, "*B"]  # passes gates; else they are obstacles
    blind: Bool[Array, "*B"]  # walks straight to the goal, and stops at anything but floor
    corner_cutting: Bool[Array, "*B"]

    def rules(self) -> Rules:
        """The rules for the planner."""
        return Rules(corner_cutting=self.corner_cutting, bumps=self.bumps, gates=self.gates)


@dataclass(frozen=True)
class Strategy:
    """A name, a planner, and what the robot may cross.

    Raises:
      InputError: a name that cannot be displayed everywhere; something that is not a planner, or not a pytree.
    """

    name: str
    planner: Planner | None = None  # None: the planner of the mission's config, by the costs of Eq. 1 by default
    bumps: bool = True
    gates: bool = True
    blind: bool = False

    def __post_init__(self):
        if not isinstance(self.name, str) or not NAME.fullmatch(self.name):
            message = "must begin with a letter and have at most 40 letters, digits, blanks and . _ + -"
            raise InputError(message, field="name of a strategy", value=self.name)
        if self.planner is not None:
            hint = "; wrap a function of NumPy arrays in HostPlanner"
            check_component(self.planner, Planner, f"planner of {self.name}", hint)

    def flags(self, corner_cutting: bool = False) -> StrategyFlags:
        """The traced part."""
        return StrategyFlags(*(jnp.asarray(v) for v in (self.bumps, self.gates, self.blind, corner_cutting)))


# The bracketed works are those of the paper's Table 1.
for _strategy in (
    Strategy("full"),  # this study
    Strategy("bump_aware", gates=False),  # [7-10]
    Strategy("gate_aware", bumps=False),  # [11, 12]
    Strategy("floor_only", bumps=False, gates=False),  # [6], and the reference of experiment 4
    Strategy("blind_stop", bumps=False, gates=False, blind=True),  # [4, 5]
):
    STRATEGIES.add(_strategy.name, _strategy)


def as_strategy(thing: object, name: str) -> Strategy:
    """The strategy given by a strategy, a planner or its class, or a function of NumPy arrays.

    Args:
      name: name of a strategy that has none yet.
    """
    if isinstance(thing, Strategy):
        return thing
    if isinstance(thing, type) and issubclass(thing, Planner):
        thing = thing()
    if not isinstance(thing, Planner) and callable(thing):
        from jaxbiped.planning.host_planner import HostPlanner

        thing = HostPlanner(thing)
    return Strategy(name, thing)


def find_strategy(name: str) -> Strategy:
    """The strategy registered under a name, or imported from `package.module:name`.

    Raises:
      InputError: an unknown name, with the known ones; a module that cannot be imported.
    """
    return STRATEGIES.find(name, as_strategy)
