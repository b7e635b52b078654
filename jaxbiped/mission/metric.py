"""Metrics: numbers of each mission besides its code, and their base class; users' metrics work like the built-in
ones."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np
import pydantic
from jaxtyping import Array, Bool, Float

from jaxbiped.config import Model, parse
from jaxbiped.core.component import as_component
from jaxbiped.core.registry import METRICS
from jaxbiped.errors import InputError

NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")  # of a column


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Step:
    """One decision of one mission, after it was played."""

    arena: Any  # `Arena`
    before: Any  # `WorldState` when the robot decided
    after: Any  # `WorldState` after its action
    command: Any  # `Command` its command
    played: Bool[Array, "*B"]  # False: the mission ended with this decision, and the robot stayed
    params: Any  # `MissionParams` of the mission

    @property
    def settings(self) -> Any:
        """`params` by its former name, which metrics may read."""
        return self.params


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class MissionEnd:
    """One mission that has ended."""

    arena: Any  # `Arena`
    result: Any  # `Result`: its code, distance, time and so on
    plan: Any  # `OraclePlan`: whether a plan exists with perfect knowledge, its cost and its length
    params: Any  # `MissionParams`

    @property
    def settings(self) -> Any:
        """`params` by its former name, which metrics may read."""
        return self.params


class MetricFormat(Model):
    """How a metric's numbers are displayed, stored with them since readers may not have the metric."""

    unit: Annotated[str, pydantic.Field(max_length=40, pattern=r"^[^$\x00-\x1f]*$")] = ""
    """without `$`, which would start formulas in figures"""
    scale: Annotated[float, pydantic.Field(allow_inf_nan=False)] = 1.0
    """factor from SI to that unit"""
    digits: Annotated[int, pydantic.Field(ge=0, le=12)] = 2
    """digits after the decimal point"""
    smaller_is_better: bool = True


class Metric:
    """Base class of metrics: a frozen dataclass that is a pytree, like planners.

    It is written for one mission. Its state during the mission is a pytree of arrays, by default empty.
    """

    unit: ClassVar[str] = ""  # unit for display
    scale: ClassVar[float] = 1.0  # factor from SI to that unit
    digits: ClassVar[int] = 2  # digits after the decimal point
    smaller_is_better: ClassVar[bool] = True
    of_servos: ClassVar[bool] = False  # whether its state is the work [J] of a simulated biped, which its driver writes

    def start(self, arena: Any, params: Any) -> Any:
        """The state before the first decision in an `Arena`."""
        return ()

    def update(self, state: Any, step: Step) -> Any:
        """The state after a decision, with the same shapes and types."""
        return state

    def result(self, state: Any, end: MissionEnd) -> tuple[Float[Array, ""], Bool[Array, ""]]:
        """The number, and whether there is one: if the robot fell on the way there may be none."""
        raise NotImplementedError(f"{type(self).__name__} has no method `result`")


def as_metric(thing: object, name: str) -> Metric:
    """The metric given as an object or as its class.

    Raises:
      InputError: anything else, or a name that is not valid for a column.
    """
    if not NAME.fullmatch(name):
        message = "must begin with a small letter and have at most 40 small letters, digits and _"
        raise InputError(message, field="name of a metric", value=name)
    return as_component(thing, Metric, f"metric {name}")


def format_of(metric: Metric, name: str) -> MetricFormat:
    """How the numbers of a metric are displayed.

    Raises:
      InputError: a unit, scale or number of digits that is not valid.
    """
    return parse(
        MetricFormat, {field: getattr(metric, field) for field in MetricFormat.model_fields}, file=f"metric {name}"
    )


def find_metric(name: str) -> Metric:
    """The metric registered under a name, or imported from `package.module:name`.

    Raises:
      InputError: an unknown name, with the known ones; a module that cannot be imported.
    """
    from jaxbiped.mission import metrics  # noqa: F401  registers those that are built in

    found = METRICS.find(name, lambda thing, own: as_metric(thing, column_of(f":{own}")))
    column = column_of(name)
    return found if column in METRICS else METRICS.add(column, found)  # tables and figures need its unit


def column_of(name: str) -> str:
    """The column of a metric in rows: its name without its module; `slow_walk` for `SlowWalk`."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name.rpartition(":")[2]).lower() if ":" in name else name


def begun(metrics: tuple[Metric, ...], arena: Any, params: Any) -> tuple:
    """The state of each metric at the start of one mission."""
    return tuple(jax.tree.map(jnp.asarray, metric.start(arena, params)) for metric in metrics)


def updated(metrics: tuple[Metric, ...], states: tuple, step: Step) -> tuple:
    """The states after a decision.

    Raises:
      InputError: a metric whose state changes its shapes or types.
    """
    found = []
    for metric, state in zip(metrics, states, strict=True):
        new = metric.update(state, step)
        kinds = [jax.tree.map(lambda leaf: (jnp.shape(leaf), jnp.result_type(leaf)), tree) for tree in (state, new)]
        if kinds[0] != kinds[1]:
            message = f"its update returned {described(new)} where its start gave {described(state)}"
            raise InputError(message, field=f"metric {type(metric).__name__}")
        found.append(new)
    return tuple(found)


def described(tree: Any) -> str:
    """Types and shapes of a pytree, for a message."""
    leaves = jax.tree.leaves(tree)
    return ", ".join(f"{jnp.result_type(leaf)}{list(jnp.shape(leaf))}" for leaf in leaves) or "nothing"


def numbers_at_end(metrics: tuple[Metric, ...], states: tuple, end: MissionEnd) -> tuple:
    """(value, valid) of each metric for one mission.

    Raises:
      InputError: a result that is not one number and one boolean.
    """
    found = []
    for metric, state in zip(metrics, states, strict=True):
        made = metric.result(state, end)
        name = f"metric {type(metric).__name__}"
        if not isinstance(made, tuple) or len(made) != 2:
            raise InputError("its result must be (value, valid)", field=name, value=type(made).__name__)
        for part, kinds in zip(made, ("fiu", "b"), strict=True):
            if jnp.shape(part) != () or np.dtype(jnp.result_type(part)).kind not in kinds:
                message = f"its result is {described(made)} where one number and one boolean are required"
                raise InputError(message, field=name)
        found.append((jnp.asarray(made[0], jnp.float32), jnp.asarray(made[1])))
    return tuple(found)
