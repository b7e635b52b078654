"""Primitives that are as fast, or as stable, as the servos allow: phases and pressure points found with optax.

The whole generator is differentiable, so the gradient of a primitive's duration or stability margin with respect to its
phases is exact. The result is tabulated like any other primitive, with every limit checked again.
"""

from __future__ import annotations

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array, Float

from jaxbiped.biped.config import RobotModelConfig
from jaxbiped.biped.gait import Motion, PrimitiveTable, pendulum_height, perform, tabulate
from jaxbiped.biped.leg import Biped
from jaxbiped.biped.request import Request
from jaxbiped.biped.score import CHANNELS, PHASES, SHORTEST_REST, Score, compose, schedule
from jaxbiped.biped.zmp import second_difference
from jaxbiped.errors import InputError
from jaxbiped.motion.config import Goal

HEADROOM = 0.95  # fraction of each limit that the search may use
SEARCH_KNOTS = 256  # samples while searching: a quarter of the table's, for a quarter of the time
OFF_UNIT = 0.005  # [m] unit of the variables that move pressure points, so that Adam's steps suit them
SHORTEST_PHASE = 0.25  # [s]: ten times the servos' lag kv/kp; shorter phases are not executed as planned
PENALTY = 30.0  # weight of a relative violation against a relative gain
STRETCH, STRETCHES = 1.02, 25  # stretching of the durations until the table passes its checks


def optimise(
    request: Request, robot: RobotModelConfig, goal: Goal = "duration", least_margin: float = 0.012, steps: int = 150
) -> PrimitiveTable:
    """The shortest primitive that keeps `least_margin`, or the one of the request's duration with the widest margin.

    Free variables are the durations of all phases and, at each change of feet, where the weight is carried. Adam
    follows the gradient of goal and violations of joint speed, torque (holding and turning the servo's own inertia),
    stability margin and rest.

    Args:
      least_margin: [m] distance of the zero moment point from the support polygon's edge, if the goal is "duration".

    Raises:
      InputError: as in `generate` for the request itself; or if no solution found passes.
    """
    song = compose(request, robot)
    count = len(song.names)
    first = schedule(song, request.duration)
    if first.min() <= 0.0:
        field = f"{request.name}: duration"
        raise InputError("too short: no time is left for steps", field=field, value=request.duration)
    score = song.score(first)
    moves = np.flatnonzero(np.any(np.asarray(score.delta)[:, :2] != 0.0, axis=1) | _shifts(score))
    used = jnp.asarray(np.arange(PHASES) < count, jnp.float32)
    shift = np.zeros((len(score.phase), len(moves)), np.float32)
    for k, row in enumerate(moves):
        shift[row, k] = 1.0
        if k + 1 < len(moves):
            shift[moves[k + 1], k] = -1.0
    shift[:, -1:] = 0.0  # the last change of feet leads to the middle, where every primitive ends
    shift = jnp.asarray(np.pad(shift, ((0, 0), (0, PHASES - len(moves)))))
    fixed = goal == "margin"
    servo = robot.servo
    limits = jnp.array([np.deg2rad(servo.speed), servo.torque, servo.armature, least_margin], jnp.float32)
    arguments = (score, used, shift, robot.traced(), pendulum_height(request, robot), limits)
    variables = {"log": jnp.log(jnp.maximum(score.durations, 1e-3)), "off": jnp.zeros((PHASES, 2))}
    state = _optimiser(steps).init(variables)
    best, best_loss = variables, np.inf  # the request's own durations, if nothing better is found
    for _ in range(steps):
        updated, state, loss = _step(variables, state, arguments, fixed, steps)
        if not np.isfinite(loss):
            break
        if loss < best_loss:
            best, best_loss = variables, float(loss)
        variables = updated
    return _verified(request, robot, song.names, best, arguments, fixed, goal, least_margin)


def _shifts(score: Score) -> np.ndarray:
    """[R] Whether each ramp moves the load from foot to foot."""
    return np.asarray(score.delta)[:, CHANNELS.index("load")] != 0.0


@functools.lru_cache(maxsize=8)
def _optimiser(steps: int) -> optax.GradientTransformation:
    return optax.chain(optax.clip_by_global_norm(5.0), optax.adam(optax.cosine_decay_schedule(0.03, steps)))


def _vary(variables: dict, arguments: tuple, fixed: bool) -> Score:
    """The score with other durations (with the same sum, if `fixed`) and other pressure points."""
    score, used, shift = arguments[:3]
    durations = jnp.exp(variables["log"]) * used
    if fixed:
        durations = durations * jnp.sum(score.durations) / jnp.sum(durations)
    off = jnp.zeros((score.delta.shape[1], 2)).at[jnp.array([0, 1]), jnp.array([0, 1])].set(1.0)
    delta = score.delta + shift @ (OFF_UNIT * variables["off"]) @ off.T
    return dataclasses.replace(score, durations=durations, delta=delta)


def _loss(variables: dict, arguments: tuple, fixed: bool) -> Float[Array, ""]:
    score, _, _, biped, height, (speed, torque, armature, least) = arguments
    varied = _vary(variables, arguments, fixed)
    motion = perform(varied, biped, height, SEARCH_KNOTS)
    over = _violation(motion, varied, biped, speed, torque, armature)
    softest = -jax.nn.logsumexp(-motion.margin / 0.001) * 0.001  # [m] a smooth minimum
    if fixed:
        return -softest / 0.01 + PENALTY * over
    time = jnp.sum(varied.durations) / jnp.sum(score.durations)
    return time + PENALTY * (over + jax.nn.relu((least + 0.003 - softest) / 0.01) ** 2)


def _violation(motion: Motion, score: Score, biped: Biped, speed, torque, armature) -> Float[Array, ""]:
    """Squared violations of the servos' limits, and shortfalls of the rests, in relative terms."""
    dt = motion.time[1]
    turning = jnp.abs(jnp.diff(motion.q, axis=0)) / dt / (HEADROOM * speed)
    pulling = jnp.abs(motion.torque + armature * second_difference(motion.q, dt)) / (HEADROOM * torque)
    last = score.durations[jnp.sum(score.durations > 0) - 1]
    rest = 1.0 - jnp.stack([score.durations[0], last]) / SHORTEST_REST
    reach = 1.0 - motion.slack / 0.002
    phase = jnp.where(score.durations > 0, 1.0 - score.durations / SHORTEST_PHASE, 0.0)
    worst = [jnp.max(jax.nn.relu(v), axis=0) for v in (turning - 1.0, pulling - 1.0, rest, reach, phase)]
    return sum(jnp.sum(v**2) for v in worst)


@functools.partial(jax.jit, static_argnums=(3, 4))
def _step(variables: dict, state, arguments: tuple, fixed: bool, steps: int):
    loss, gradient = jax.value_and_grad(_loss)(variables, arguments, fixed)
    updates, state = _optimiser(steps).update(gradient, state)
    return optax.apply_updates(variables, updates), state, loss


def _verified(request, robot, names, variables, arguments, fixed, goal, least_margin) -> PrimitiveTable:
    """Stretch the result in small steps until it passes every check."""
    varied, (biped, height) = _vary(variables, arguments, fixed), arguments[3:5]
    error = None
    for k in range(1 if fixed else STRETCHES):
        durations = np.asarray(varied.durations, np.float64)[: len(names)] * STRETCH**k
        score = dataclasses.replace(varied, durations=varied.durations * STRETCH**k)
        try:
            table = tabulate(request, robot, names, durations, jax.device_get(perform(score, biped, height)))
        except InputError as problem:
            error = problem
            continue
        if fixed or table.margin >= least_margin:
            return table
        error = InputError(f"no {goal} found keeps {1000 * least_margin:.0f} mm of margin", field=request.name)
    raise error
