"""Tune costs on training arenas by gradient, and evaluate them on test arenas against the initial costs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import optax
import polars as pl
from jaxtyping import Float, Int

from jaxbiped.mission.batched_driver import OnProgress, Result, Tally, tally
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import CostConfig, MissionConfig
from jaxbiped.statistics.intervals import Estimate, mean_and_median
from jaxbiped.statistics.paired import PairedMetric, metric_difference, success_difference
from jaxbiped.study.durations import fit
from jaxbiped.study.evaluation import Progress
from jaxbiped.study.search import directions, gradient, sobol
from jaxbiped.study.trials import NAMES, Trials, objective
from jaxbiped.study.tuning_config import TuneConfig as TuneConfig

FIRST_TRAINING = 100_000_000  # index of the first training arena: beyond the arenas of every study
START, TUNED, SWEPT, DURATIONS = "start", "tuned", "sweep", "durations"
PAIRS = ((TUNED, START), (TUNED, SWEPT), (SWEPT, START), (DURATIONS, START))


# (costs [P, 5], arenas [A], callback for a tally of the missions) -> results [P, A]; such as `trials.Trials`
Play = Callable[[np.ndarray, np.ndarray, OnProgress], Result]


@dataclass(frozen=True)
class Gap:
    """Two sets of costs on the test arenas. Differences are first minus second."""

    first: str
    second: str
    objective: Estimate  # [s] mean difference
    success: Estimate
    time: PairedMetric  # [s] on arenas where both arrived


@dataclass(frozen=True)
class Tuning:
    """The result of tuning."""

    costs: dict[str, tuple[float, ...]]  # C0 to C4 by name
    history: pl.DataFrame  # one row per step: costs, objective [s] of its missions, and of `start` on its arenas
    swept: pl.DataFrame  # one row per point of the sweep
    test: pl.DataFrame  # one row per test arena and set of costs
    gaps: tuple[Gap, ...]


def tune(
    config: TuneConfig, play: Play | None = None, on_progress: Callable[[Progress], None] = lambda progress: None
) -> Tuning:
    """Tune costs, sweep them for comparison, and evaluate both, and those that durations imply, on test arenas.

    The descent follows the signs of the gradient of the perturbed objective (`search`; sign descent of optax) in the
    logarithms of C1 to C4 over C0, inside the box [low, high]. It uses signs because now and then one perturbed mission
    falls: a thousand seconds in one arena, where the slopes of interest are a few. Adam, which keeps squares, would be
    disturbed by a single one for all of its steps. The result is the mean of the logarithms over the second half of the
    steps, since a noisy descent wanders about the optimum that it has found.

    Costs are perturbed instead of smoothing the planner: a softmin over the paths of a known map captures neither C4,
    which acts through what is measured on the way, nor failures, and a mission's time is not a function of its path's
    cost.

    The best point of the sweep is the one with the lowest objective over all training arenas.

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
        gap(pair, [list(costs).index(name) for name in pair], result, seconds, config.seed)
        for pair in PAIRS
        if set(pair) <= set(costs)
    )
    return Tuning(costs, history, swept, tested(config, tuple(costs), test, result, seconds), gaps)


def vector(costs: CostConfig) -> Float[np.ndarray, "5"]:
    """C0 to C4."""
    return np.array([getattr(costs, name) for name in NAMES])


def from_durations(mission: MissionConfig) -> Float[np.ndarray, "5"]:
    """C0 to C3 from the durations of the mission's primitives, including measurements; its own C4 and minimum C0."""
    found = np.append(fit(mission.durations, measuring=True).costs, mission.costs.c4)
    return np.maximum(found, [0.1, 0.0, 0.0, 0.0, 0.0])


def descend(
    config: TuneConfig,
    start: Float[np.ndarray, "5"],
    train: Int[np.ndarray, "N"],
    began: Float[np.ndarray, "N"],
    run: Callable[[np.ndarray, np.ndarray], Result],
) -> tuple[Float[np.ndarray, "5"], pl.DataFrame]:
    """Run the descent; return the costs it ends at, and its history."""
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
    """Run the sweep: Sobol points, their objective, and the share of missions that arrived."""
    places = sobol(config.sweep_points, *np.log([config.low, config.high]), 4, config.seed)
    points = c0 * np.exp(np.column_stack([np.zeros(len(places)), places]))
    result = run(points, train)
    columns = dict(zip(NAMES, points.T, strict=True))
    columns["objective"] = objective(result, config.penalty).mean(1)
    return pl.DataFrame(columns | {"success": (result.code == Code.REACHED).mean(1)})


def gap(
    pair: tuple[str, str], rows: Sequence[int], result: Result, seconds: Float[np.ndarray, "P A"], seed: int
) -> Gap:
    """Compare two cost vectors by their rows of the results. `seed` seeds the bootstraps."""
    f, s = rows
    reached = result.code == Code.REACHED
    both = reached[f] & reached[s]
    mean, _ = mean_and_median(np.round(seconds[f] - seconds[s], 4), seed=seed)
    time = metric_difference(*(result.time[k, both].astype(float) for k in (f, s)), seed=seed)
    return Gap(*pair, mean, success_difference(reached[f], reached[s]), time)


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
