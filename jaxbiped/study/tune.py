"""Costs tuned on training arenas by gradient, and judged on test arenas against those that they began from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import optax
import polars as pl
import pydantic
import tyro
from jaxtyping import Float, Int

from jaxbiped.config import Model
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.queue import OnProgress, Result, Tally, tally
from jaxbiped.mission.settings import SIMULATED, CostConfig, MissionConfig
from jaxbiped.study.config import Family
from jaxbiped.study.durations import fit
from jaxbiped.study.evaluate import Progress
from jaxbiped.study.intervals import Estimate, mean_and_median
from jaxbiped.study.paired import PairedMetric, metric_difference, success_difference
from jaxbiped.study.schema import FAMILIES, STRATEGIES
from jaxbiped.study.search import directions, gradient, sobol
from jaxbiped.study.trials import NAMES, Trials, objective

FIRST_TRAINING = 100_000_000  # index of the first training arena: beyond the arenas of every study
SENSORS = ("raycast", "oracle")
START, TUNED, SWEPT, DURATIONS = "start", "tuned", "sweep", "durations"
Plans = Literal[tuple(name for name in STRATEGIES if name != "blind_stop")]
PAIRS = ((TUNED, START), (TUNED, SWEPT), (SWEPT, START), (DURATIONS, START))
Positive = Annotated[int, pydantic.Field(ge=1, le=100_000_000)]


class TuneConfig(Model):
    """Costs tuned on random arenas.

    The planner takes the same paths when all costs double, so that C0 stays as it is, and log(C1 / C0) to log(C4 / C0)
    are tuned. The objective is the mean time of a mission, where a failure counts `penalty`.
    """

    seed: Annotated[int, pydantic.Field(ge=0, lt=2**32)] = 0
    """Of arenas, noise, perturbations and intervals."""
    arenas: Positive = 1024
    """Training arenas: numbers 100,000,000 and up, which no study compares on."""
    test_arenas: Positive = 2048
    """Test arenas: numbers 0 and up, those of `jaxbiped compare` with this seed."""
    families: Annotated[tuple[Family, ...], pydantic.Field(min_length=1)] = FAMILIES
    """They take turns: arena k is of family k modulo their number."""
    strategy: Plans = "full"
    """Whose missions; the way of `blind_stop` does not depend on costs."""
    steps: Positive = 32
    """Steps of the descent."""
    batch: Positive = 32
    """Training arenas of a step; steps take them in turn."""
    pairs: Annotated[int, pydantic.Field(ge=1, le=1024)] = 4
    """Pairs of perturbed costs of a step, all on the same arenas with the same noise."""
    radius: Annotated[float, pydantic.Field(gt=0.0, le=3.0)] = 1.0
    """By how much the logarithms are perturbed, together."""
    rate: Annotated[float, pydantic.Field(gt=0.0, le=3.0)] = 0.15
    """What each logarithm changes in the first step; it falls to 0 as a cosine."""
    penalty: Annotated[float, pydantic.Field(gt=0.0, le=1e6)] = 1800.0
    """[s] that a failed mission counts, and a longer one too."""
    low: Annotated[float, pydantic.Field(ge=1e-3, le=1e3)] = 0.1
    """Least of C1 to C4, in C0."""
    high: Annotated[float, pydantic.Field(ge=1e-3, le=1e3)] = 100.0
    """Greatest of C1 to C4, in C0."""
    sweep: Annotated[int, pydantic.Field(ge=0, le=1000)] = 10
    """A sweep over Sobol points of the same box gets this many times the missions of the tuning; 0: none."""
    mission: Annotated[MissionConfig, tyro.conf.arg(name="")] = MissionConfig()

    @pydantic.model_validator(mode="after")
    def _possible(self):
        if self.high <= self.low:
            raise ValueError("high must be above low")
        if len(set(self.families)) < len(self.families):
            raise ValueError("families must be named once each")
        if self.mission.executor in SIMULATED:
            raise ValueError("executor must be kinematic or sampled: tuning takes thousands of missions")
        if self.mission.sensor not in SENSORS:
            raise ValueError(f"sensor must be {' or '.join(SENSORS)}: tuning takes thousands of missions")
        return self

    @property
    def tuning_missions(self) -> int:
        """Missions of the tuning: its steps, and the costs that it begins from on each training arena."""
        return self.steps * self.batch * 2 * self.pairs + self.arenas

    @property
    def sweep_points(self) -> int:
        """Points of the sweep, each on all training arenas."""
        return -(-self.sweep * self.tuning_missions // self.arenas)


# (costs [P, 5], arenas [A], what is called with a tally of the missions): results [P, A]; `trials.Trials` is one
Play = Callable[[np.ndarray, np.ndarray, OnProgress], Result]


@dataclass(frozen=True)
class Gap:
    """Two sets of costs on the test arenas. Differences are first less second."""

    first: str
    second: str
    objective: Estimate  # [s] mean difference
    success: Estimate
    time: PairedMetric  # [s] on arenas where both arrived


@dataclass(frozen=True)
class Tuning:
    """What came of it."""

    costs: dict[str, tuple[float, ...]]  # C0 to C4 by name
    history: pl.DataFrame  # a row a step: costs before it, objective [s] of its missions, and of `start` on its arenas
    swept: pl.DataFrame  # a row a point of the sweep
    test: pl.DataFrame  # a row a test arena and set of costs
    gaps: tuple[Gap, ...]


def tune(
    config: TuneConfig, play: Play | None = None, on_progress: Callable[[Progress], None] = lambda progress: None
) -> Tuning:
    """Tune costs, sweep them for comparison, and judge both, and those that durations stand for, on test arenas.

    The descent follows the signs of the gradient of the perturbed objective (`search`; sign descent of optax) in the
    logarithms of C1 to C4 over C0, inside the box [low, high]. Signs, because now and then one perturbed mission falls:
    a thousand seconds in one arena, where the slopes to be found are a few. Adam, which remembers squares, is thrown
    off by a single one for all of its steps. What is given is the mean of the logarithms over the second half of the
    steps, since a noisy descent wanders about the place that it has found.

    Costs are perturbed, and not the planner smoothed: a softmin over the paths of a known map knows nothing of C4,
    which acts through what is measured on the way, nor of failures, and a mission's time is no function of its path's
    cost.

    The best point of the sweep is the one with the least objective over all training arenas.

    Consumes the streams (seed, step) of numpy's `default_rng`, and `jax.random.key(seed)` for arenas and noise.
    """
    play = play or Trials(config.mission, config.strategy, config.families, config.seed)
    train, test = FIRST_TRAINING + np.arange(config.arenas), np.arange(config.test_arenas)
    start = vector(config.mission.costs)
    costs = {START: start, DURATIONS: from_durations(config.mission)}
    total = config.tuning_missions + config.sweep_points * config.arenas
    total += len(test) * (3 + (config.sweep > 0))
    before = [Tally(0, 0)]

    def run(points: Float[np.ndarray, "P 5"], index: Int[np.ndarray, "A"]) -> Result:
        def tell(more: Tally) -> None:
            so_far = before[0] + more
            on_progress(Progress(so_far.ended, so_far.reached, total))

        result = play(points, index, tell)
        before[0] += tally(result.code.ravel())
        return result

    began = objective(run(start[None], train), config.penalty)[0]
    costs[TUNED], history = descend(config, start, train, began, run)
    swept = pl.DataFrame(schema={**dict.fromkeys(NAMES, pl.Float64), "objective": pl.Float64, "success": pl.Float64})
    if config.sweep:
        swept = spread_out(config, start[0], train, run)
        costs[SWEPT] = swept.sort("objective", maintain_order=True).select(NAMES).row(0)
    costs = {name: costs[name] for name in (START, TUNED, SWEPT, DURATIONS) if name in costs}
    costs = {name: tuple(float(f"{value:.4g}") for value in values) for name, values in costs.items()}  # as written
    result = run(np.array(list(costs.values())), test)
    seconds = objective(result, config.penalty)
    gaps = tuple(
        gap(first, second, *(list(costs).index(name) for name in (first, second)), result, seconds, config.seed)
        for first, second in PAIRS
        if {first, second} <= set(costs)
    )
    return Tuning(costs, history, swept, tested(config, tuple(costs), test, result, seconds), gaps)


def vector(costs: CostConfig) -> Float[np.ndarray, "5"]:
    """C0 to C4."""
    return np.array([getattr(costs, name) for name in NAMES])


def from_durations(mission: MissionConfig) -> Float[np.ndarray, "5"]:
    """C0 to C3 from the times of the mission's primitives, measurements included; its own C4 and least C0."""
    found = np.append(fit(mission.durations, measuring=True).costs, mission.costs.c4)
    return np.maximum(found, [0.1, 0.0, 0.0, 0.0, 0.0])


def descend(
    config: TuneConfig,
    start: Float[np.ndarray, "5"],
    train: Int[np.ndarray, "N"],
    began: Float[np.ndarray, "N"],
    run: Callable[[np.ndarray, np.ndarray], Result],
) -> tuple[Float[np.ndarray, "5"], pl.DataFrame]:
    """The descent: the costs it ends at, and its history."""
    box = np.log([config.low, config.high])
    c0, tiny = start[0], np.exp(box[0])
    place = np.clip(np.log(np.maximum(start[1:] / c0, tiny)), *box)
    descent = optax.sign_sgd(optax.cosine_decay_schedule(config.rate, config.steps))
    state, rows, places = descent.init(place), [], []
    for step in range(config.steps):
        index = (step * config.batch + np.arange(config.batch)) % len(train)
        along = directions(np.random.default_rng((config.seed, step)), config.pairs, len(place))
        tried = place + config.radius * np.concatenate([along, -along])
        result = run(c0 * np.exp(np.column_stack([np.zeros(len(tried)), np.clip(tried, *box)])), train[index])
        seconds = objective(result, config.penalty).mean(1)
        slope = gradient(*np.split(seconds, 2), along, config.radius)
        values = dict(zip(NAMES, c0 * np.exp([0.0, *place]), strict=True))
        spent = {"objective": seconds.mean(), "start": began[index].mean()}
        slopes = {f"slope_{name}": value for name, value in zip(NAMES[1:], slope, strict=True)}
        rows.append({"step": step, **values, **spent, **slopes})
        change, state = descent.update(slope, state)
        place = np.clip(place + np.asarray(change, float), *box)
        places.append(place)
    found = np.mean(places[config.steps // 2 :], axis=0)
    return c0 * np.exp([0.0, *found]), pl.DataFrame(rows)


def spread_out(
    config: TuneConfig,
    c0: float,
    train: Int[np.ndarray, "N"],
    run: Callable[[np.ndarray, np.ndarray], Result],
) -> pl.DataFrame:
    """The sweep: Sobol points, their objective, and the share of missions that arrived."""
    places = sobol(config.sweep_points, *np.log([config.low, config.high]), 4, config.seed)
    points = c0 * np.exp(np.column_stack([np.zeros(len(places)), places]))
    result = run(points, train)
    columns = dict(zip(NAMES, points.T, strict=True))
    columns["objective"] = objective(result, config.penalty).mean(1)
    return pl.DataFrame(columns | {"success": (result.code == Code.REACHED).mean(1)})


def gap(first: str, second: str, f: int, s: int, result: Result, seconds: Float[np.ndarray, "P A"], seed: int) -> Gap:
    """Rows `f` and `s` of the results compared. `seed` seeds the bootstraps."""
    reached = result.code == Code.REACHED
    both = reached[f] & reached[s]
    mean, _ = mean_and_median(np.round(seconds[f] - seconds[s], 4), seed=seed)
    time = metric_difference(*(result.time[k, both].astype(float) for k in (f, s)), seed=seed)
    return Gap(first, second, mean, success_difference(reached[f], reached[s]), time)


def tested(
    config: TuneConfig, names: tuple[str, ...], index: Int[np.ndarray, "A"], result: Result, seconds: np.ndarray
) -> pl.DataFrame:
    """The test missions as a table."""
    labels = np.array([code.label for code in Code if code != Code.RUNNING])
    columns = {
        "arena": np.tile(index, len(names)),
        "family": np.tile(np.array(config.families)[index % len(config.families)], len(names)),
        "costs": np.repeat(names, len(index)),
        "code": labels[result.code].ravel(),
        "objective": seconds.ravel(),
        "elapsed": result.time.ravel().astype(float),
        "walked": result.distance.ravel().astype(float),
    }
    return pl.DataFrame(columns)
