"""Compare strategies on the same arenas, overall and in strata."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import polars as pl
from jaxtyping import Float

from jaxbiped.errors import InputError
from jaxbiped.mission.metric import MetricFormat
from jaxbiped.statistics.intervals import NOTHING, Estimate, mean_and_median, proportion
from jaxbiped.statistics.metric_differences import corrected_metrics, metric_means, metric_pairs
from jaxbiped.statistics.multiple_testing import holm
from jaxbiped.statistics.paired import PairedMetric, metric_difference, success_difference
from jaxbiped.statistics.schema import CODES, metric_columns, ordered, ordered_families, validate

OWN = 1  # stream of the seed for bootstraps of a single strategy
QUESTION = ("bump_aware", "floor_only")  # the pair behind the project's question


@dataclass(frozen=True)
class Stratum:
    """A set of arenas: all of them, one family, or one third of the difficulties."""

    kind: str  # "all", "family" or "difficulty"
    name: str


ALL = Stratum("all", "all arenas")


@dataclass(frozen=True)
class StrategySummary:
    """One strategy on one stratum."""

    stratum: Stratum
    strategy: str
    n: int  # arenas
    success: Estimate
    reachable: Estimate  # share of arenas with an oracle plan for this strategy
    success_of_reachable: Estimate  # success on those: failures come from sensing and walking, not from planning
    codes: tuple[int, ...]  # missions by how they ended, in the order of CODES
    distance: Estimate  # [m] mean over its own reached missions, whose arenas differ between strategies. It has an
    # interval over all arenas; in families and thirds there are too many of them to compute
    time: Estimate  # [s] the same
    metrics: dict[str, Estimate] = field(default_factory=dict)  # of each other column: mean over missions that have it


@dataclass(frozen=True)
class PairComparison:
    """Two strategies on the arenas of one stratum for which both have a row. Differences are first minus second."""

    stratum: Stratum
    first: str
    second: str
    success: Estimate  # difference of the success rates
    first_only: int  # arenas that only the first solved
    second_only: int
    distance: PairedMetric  # [m]
    time: PairedMetric  # [s]
    metrics: dict[str, PairedMetric] = field(default_factory=dict)  # of each other column, where both have it


@dataclass(frozen=True)
class Comparison:
    """All results that a report gives for one sweep point."""

    point: int
    level: float  # confidence level of every interval
    seed: int  # seed of the bootstraps
    resamples: int
    strategies: tuple[str, ...]
    summaries: tuple[StrategySummary, ...]
    pairs: tuple[PairComparison, ...]
    shown: Mapping[str, MetricFormat] = field(default_factory=dict)  # how columns of metrics are shown, where known

    @property
    def metrics(self) -> tuple[str, ...]:
        """The columns by which strategies were compared, other than success, distance and time."""
        return tuple(self.summaries[0].metrics) if self.summaries else ()

    @property
    def question(self) -> tuple[str, str] | None:
        """The pair that a report is about: the project's question, else the first pair; None without pairs."""
        pairs = [(pair.first, pair.second) for pair in self.pairs]
        return QUESTION if QUESTION in pairs else next(iter(pairs), None)

    def strata(self, kind: str) -> tuple[Stratum, ...]:
        """The strata of one kind, in order."""
        return tuple(dict.fromkeys(item.stratum for item in self.summaries if item.stratum.kind == kind))

    def pair(self, first: str, second: str, stratum: Stratum = ALL) -> PairComparison | None:
        """One pair on one stratum; None if it was not compared."""
        wanted = (stratum, first, second)
        return next((pair for pair in self.pairs if (pair.stratum, pair.first, pair.second) == wanted), None)

    def summary(self, strategy: str, stratum: Stratum = ALL) -> StrategySummary | None:
        """One strategy on one stratum; None if it has no arenas."""
        return next((item for item in self.summaries if (item.stratum, item.strategy) == (stratum, strategy)), None)


def default_pairs(strategies: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """The project's question first, then the first strategy against each other one."""
    baseline = [(strategies[0], other) for other in strategies[1:]]
    question = [QUESTION] if set(QUESTION) <= set(strategies) else []
    return tuple(dict.fromkeys(question + baseline))


def compare(
    frame: pl.DataFrame,
    *,
    point: int = 0,
    pairs: Sequence[tuple[str, str]] | None = None,
    seed: int = 0,
    resamples: int = 4999,
    level: float = 0.95,
    shown: Mapping[str, MetricFormat] | None = None,
) -> Comparison:
    """Compare the strategies of one sweep point; see `compare_named`.

    Args:
      frame: rows of `schema.SCHEMA`.
      pairs: (first, second) to compare; by default `default_pairs`.
      seed: seed of the bootstraps; each gets its own stream from it.
      shown: how numbers of metrics are displayed, from the manifest.
    """
    frame = validate(frame).filter(pl.col("point") == point).sort("arena")
    if frame.is_empty():
        raise InputError("no row of this sweep point", field="point", value=point)
    present = set(frame["strategy"])
    strategies = ordered(present)
    pairs = default_pairs(strategies) if pairs is None else tuple(pairs)
    for name in {name for pair in pairs for name in pair} - present:
        raise InputError(f"must be one of {', '.join(strategies)}", field="pairs", value=name)
    return compare_named(
        frame, strategies, pairs, point=point, seed=seed, resamples=resamples, level=level, shown=shown
    )


def compare_named(
    frame: pl.DataFrame,
    names: Sequence[str],
    pairs: Sequence[tuple[str, str]],
    *,
    point: int = 0,
    seed: int = 0,
    resamples: int = 4999,
    level: float = 0.95,
    shown: Mapping[str, MetricFormat] | None = None,
) -> Comparison:
    """Compare the sides named in the column `strategy`, arena by arena.

    Holm's correction covers all p-values of a table: success, distance and time of all pairs, over all arenas, over
    all families together, and over all difficulties together. Other metrics are compared over all arenas, and for the
    first pair also in every stratum; they are corrected separately, so that adding one changes no other p-value.

    Args:
      frame: the columns of `schema.SCHEMA`, with at most one row per arena and name.
      names: the names, in the order of tables.
    """
    strategies = tuple(names)
    rng = np.random.default_rng(seed)
    own = {"seed": int(np.random.default_rng([seed, OWN]).integers(2**32)), "resamples": resamples}
    summaries, compared, others = [], [], metric_columns(frame)
    leading = QUESTION if QUESTION in pairs else next(iter(pairs), None)
    for stratum, rows in strata(frame):
        by_name = {name: rows.filter(pl.col("strategy") == name) for name in strategies}
        of_means = own if stratum == ALL else None
        summaries += [summarise(stratum, name, by_name[name], level, of_means) for name in strategies]
        for first, second in pairs:
            options = {"seed": int(rng.integers(2**32)), "resamples": resamples, "level": level}
            pair = compare_pair(stratum, (first, by_name[first]), (second, by_name[second]), **options)
            if stratum == ALL or (first, second) == leading:
                pair = replace(pair, metrics=metric_pairs(by_name[first], by_name[second], others, **options))
            compared.append(pair)
    return Comparison(
        point=point,
        level=level,
        seed=seed,
        resamples=resamples,
        strategies=strategies,
        summaries=tuple(summaries),
        pairs=corrected_metrics(corrected(compared)),
        shown=shown or {},
    )


def strata(frame: pl.DataFrame) -> Iterator[tuple[Stratum, pl.DataFrame]]:
    """All rows, then those of each family, then those of each third of the arenas by difficulty."""
    yield ALL, frame
    for family in ordered_families(frame["family"]):
        yield Stratum("family", family), frame.filter(pl.col("family") == family)
    difficulty = pl.col("difficulty")
    values = frame.unique("arena")["difficulty"].to_numpy()
    # Equally difficult arenas stay together, so thirds can be unequal, or fewer than three.
    edges = np.unique(np.quantile(values, [1 / 3, 2 / 3], method="lower"))
    bounds = [-np.inf, *edges, np.inf]
    for low, high in itertools.pairwise(bounds):
        rows = frame.filter((difficulty > low) & (difficulty <= high))
        if len(rows):
            yield Stratum("difficulty", f"{rows['difficulty'].min():.2f} to {rows['difficulty'].max():.2f}"), rows


def summarise(
    stratum: Stratum, strategy: str, rows: pl.DataFrame, level: float, of_means: dict[str, int] | None = None
) -> StrategySummary:
    """Summarise one strategy's rows in one stratum.

    Args:
      of_means: seed and resamples of the bootstraps of its means; None: means get no intervals.
    """
    reached = rows.filter("success")
    reachable = rows.filter("reachable")
    counts = dict(rows["code"].value_counts().iter_rows())
    means = {name: own_mean(reached[name].to_numpy(), level, of_means) for name in ("distance", "time")}
    return StrategySummary(
        stratum=stratum,
        strategy=strategy,
        n=len(rows),
        success=proportion(len(reached), len(rows), level),
        reachable=proportion(len(reachable), len(rows), level),
        success_of_reachable=proportion(int(reachable["success"].sum()), len(reachable), level),
        codes=tuple(counts.get(code, 0) for code in CODES),
        metrics=metric_means(rows, metric_columns(rows)),
        **means,
    )


def own_mean(samples: Float[np.ndarray, "n"], level: float, bootstrap: dict[str, int] | None) -> Estimate:
    """The mean over one strategy's missions, with the same kind of interval as paired means if a bootstrap is given."""
    if len(samples) == 0:
        return NOTHING
    if bootstrap is None:
        return Estimate(float(np.mean(samples)), n=len(samples))
    return mean_and_median(samples, level=level, **bootstrap)[0]


def compare_pair(
    stratum: Stratum,
    first: tuple[str, pl.DataFrame],
    second: tuple[str, pl.DataFrame],
    *,
    seed: int,
    resamples: int,
    level: float,
) -> PairComparison:
    """Compare two strategies (name, rows) on the arenas that both have, in the order of the arenas."""
    both, solved = paired(first[1], second[1])
    a, b = both["success"].to_numpy(), both["success_second"].to_numpy()
    metrics = {
        name: metric_difference(
            solved[name].to_numpy(), solved[f"{name}_second"].to_numpy(), seed=seed, resamples=resamples, level=level
        )
        for name in ("distance", "time")
    }
    return PairComparison(
        stratum=stratum,
        first=first[0],
        second=second[0],
        success=success_difference(a, b, level),
        first_only=int(np.sum(a & ~b)),
        second_only=int(np.sum(b & ~a)),
        **metrics,
    )


def paired(first: pl.DataFrame, second: pl.DataFrame) -> tuple[pl.DataFrame, pl.DataFrame]:
    """The arenas for which both have rows, and those of them that both solved, in the order of the arenas.

    The second's columns are `success_second`, `distance_second` and `time_second`.
    """
    columns = ["arena", "success", "distance", "time"]
    both = first.select(columns).join(second.select(columns), on="arena", suffix="_second").sort("arena")
    return both, both.filter(pl.col("success") & pl.col("success_second"))


def corrected(pairs: Sequence[PairComparison]) -> tuple[PairComparison, ...]:
    """The pairs with Holm's p-values, with one correction for each kind of stratum."""
    result = {}
    for kind in ("all", "family", "difficulty"):
        table = [index for index, pair in enumerate(pairs) if pair.stratum.kind == kind]
        tests = [(pairs[i].success.p, pairs[i].distance.p, pairs[i].time.p) for i in table]
        adjusted = iter(holm([p for row in tests for p in row]))
        for index in table:
            pair, (success, distance, time) = pairs[index], (next(adjusted), next(adjusted), next(adjusted))
            result[index] = replace(
                pair,
                success=replace(pair.success, p_holm=success),
                distance=replace(pair.distance, p_holm=distance),
                time=replace(pair.time, p_holm=time),
            )
    return tuple(result[index] for index in range(len(pairs)))
