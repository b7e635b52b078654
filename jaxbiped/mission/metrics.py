"""The built-in metrics, in addition to success, distance and time."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxbiped.core.registry import METRICS
from jaxbiped.executors.execution import CHECKS, TOUCH
from jaxbiped.geometry.boxes import plan_distance
from jaxbiped.mission.metric import Metric, MissionEnd, Step
from jaxbiped.mission.outcome import Code


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class PathEfficiency(Metric):
    """Success weighted by path length (SPL): length of the oracle plan over that walked, at most 1; 0 for a failure.

    Anderson et al., "On Evaluation of Embodied Navigation Agents" (2018). Deviation: the shortest path is the plan of
    lowest cost with perfect knowledge, for the same strategy. It is missing if a robot arrived without such a plan.
    """

    digits = 3
    smaller_is_better = False

    def result(self, state: tuple, end: MissionEnd) -> tuple[Float[Array, ""], Bool[Array, ""]]:
        """See `Metric`."""
        shortest, walked = end.plan.length, end.result.distance
        reached = end.result.code == Code.REACHED
        longer = jnp.maximum(walked, shortest)
        value = jnp.where(longer > 0, shortest / jnp.where(longer > 0, longer, 1.0), 1.0)
        return jnp.where(reached, value, 0.0), ~reached | (end.plan.reachable & jnp.isfinite(shortest))


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class LeastClearance(Metric):
    """[m] Smallest distance of the body from a box between its raised foot and its head; negative on contact.

    It is evaluated at a third, two thirds and the end of each step, like the referee's check. Terrain does not count.
    It is missing if there was no such box, and in arenas with moving boxes.
    """

    unit, scale, digits = "cm", 100.0, 1
    smaller_is_better = False

    def start(self, arena, params) -> Float[Array, ""]:
        """See `Metric`."""
        return jnp.full((), jnp.inf)

    def update(self, state: Float[Array, ""], step: Step) -> Float[Array, ""]:
        """See `Metric`."""
        boxes, before, after, params = step.arena.boxes, step.before.pose, step.after.pose, step.params
        head = jnp.where(step.command.squat, params.body.squatting, params.body.standing)
        foot = jnp.maximum(before.z, after.z)
        there = (boxes.top > foot + params.body.step + TOUCH) & (boxes.bottom < foot + head - TOUCH) & boxes.used
        for part in CHECKS:
            x, y = (start + part * (end - start) for start, end in ((before.x, after.x), (before.y, after.y)))
            gap = jnp.min(jnp.where(there, plan_distance(boxes, x, y), jnp.inf), initial=jnp.inf)
            state = jnp.where(step.played, jnp.minimum(state, gap - params.limits.body_radius), state)
        return state

    def result(self, state: Float[Array, ""], end: MissionEnd) -> tuple[Float[Array, ""], Bool[Array, ""]]:
        """See `Metric`."""
        return state, jnp.isfinite(state) & (end.arena.movers is None)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Replans(Metric):
    """Number of plans after the first. It is missing if no plan was made."""

    digits = 1

    def result(self, state: tuple, end: MissionEnd) -> tuple[Float[Array, ""], Bool[Array, ""]]:
        """See `Metric`."""
        calls = end.result.planned.calls
        return jnp.asarray(calls - 1, jnp.float32), calls > 0


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class MeasuringShare(Metric):
    """Share of a mission's time that was spent measuring."""

    unit, scale, digits = "%", 100.0, 1

    def result(self, state: tuple, end: MissionEnd) -> tuple[Float[Array, ""], Bool[Array, ""]]:
        """See `Metric`."""
        spent = end.result.measurements * end.params.durations.measure
        some = end.result.time > 0
        return spent / jnp.where(some, end.result.time, 1.0), some


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Energy(Metric):
    """[J] Mechanical work of the servos of a simulated biped: force times velocity, summed over the engine's steps.

    Work absorbed while braking is not recovered, and heat is not counted. It is that of the motions as played
    (`walk.pace`), not of the clock. It is missing if no biped is simulated.
    """

    unit, digits = "J", 1
    of_servos = True

    def start(self, arena, params) -> Float[Array, ""]:
        """See `Metric`."""
        return jnp.full((), jnp.nan)

    def result(self, state: Float[Array, ""], end: MissionEnd) -> tuple[Float[Array, ""], Bool[Array, ""]]:
        """See `Metric`."""
        there = jnp.isfinite(state)
        return jnp.where(there, state, 0.0), there


for _name, _metric in (
    ("spl", PathEfficiency()),
    ("clearance", LeastClearance()),
    ("replans", Replans()),
    ("measuring", MeasuringShare()),
    ("energy", Energy()),
):
    METRICS.add(_name, _metric)
