"""Confidence sequences: against the formula's own optimum, and an error rate that a simulation confirms."""

import numpy as np
import polars as pl
import pytest
from scipy import optimize, stats

from jaxbiped.statistics.sequential import (
    FIRST_LOOK,
    Goal,
    Watch,
    arenas_for,
    enough,
    least,
    look,
    observe,
    radius,
    tightest_at,
)
from tests.study.synthetic import rows

RUNS, LOOKS, SHARD = 200, 30, 60
GOALS = {
    name: Goal(name, "full", "floor_only", width)
    for name, width in (("success", 0.05), ("distance", 0.1), ("time", 20.0))
}


def draws(kind: str, rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """Samples of one long study [LOOKS, SHARD], and their true mean."""
    size = (LOOKS, SHARD)
    if kind == "success":  # 8 % of the arenas are discordant, and unevenly
        return rng.choice([1.0, -1.0, 0.0], size, p=[0.065, 0.015, 0.92]), 0.05
    if kind == "distance":  # most arenas agree, some have a long way round
        return -np.where(rng.random(size) < 0.25, rng.exponential(0.4, size), 0.0), -0.1
    return rng.normal(-6.0, 60.0, size), -6.0


@pytest.mark.parametrize("kind", ["success", "distance", "time"])
def test_all_looks_hold_at_once_where_naive_ones_do_not(kind):
    rng, goal = np.random.default_rng(5), GOALS[kind]
    missed = naive = stopped_wrong = stops = 0
    for _ in range(RUNS):
        samples, truth = draws(kind, rng)
        watch, wrong, naive_wrong, stop = Watch(), False, False, None
        for shard in samples:
            watch = observe(watch, goal, shard)
            if watch.width is None:
                continue
            out = not watch.estimate.low <= truth <= watch.estimate.high
            wrong |= out
            half = stats.norm.ppf(0.975) * np.sqrt(watch.squares / (watch.n - 1) / watch.n)
            naive_wrong |= abs(watch.mean - truth) > half
            if stop is None and enough(watch, goal):
                stop = out
        missed, naive = missed + wrong, naive + naive_wrong
        stops, stopped_wrong = stops + (stop is not None), stopped_wrong + bool(stop)
    # 5 % are allowed; four standard errors of a simulated rate on top.
    limit = 0.05 + 4 * np.sqrt(0.05 * 0.95 / RUNS)
    assert missed / RUNS <= limit, missed / RUNS
    assert naive / RUNS > 2 * limit, naive / RUNS
    assert stops > RUNS / 2 and stopped_wrong / stops <= limit


def test_the_intensity_is_the_best_for_its_moment():
    n, alpha = 700, 0.05
    best = optimize.minimize_scalar(
        lambda x: radius(2.0, n, float(np.exp(x)), alpha), bounds=(-20, 5), method="bounded"
    )
    assert np.log(tightest_at(n, alpha)) == pytest.approx(best.x, abs=1e-3)
    u = least(alpha)
    assert u - np.log(u) == pytest.approx(1 - 2 * np.log(alpha))
    assert radius(2.0, n, tightest_at(n, alpha), alpha) == pytest.approx(np.sqrt(2.0 * u / n))


def test_the_width_comes_when_it_was_foreseen():
    n = arenas_for(0.08, 0.05, 0.05)
    assert 2 * radius(0.08, n, tightest_at(n, 0.05), 0.05) == pytest.approx(0.05)


def test_in_parts_is_the_same_as_at_once():
    samples = np.random.default_rng(1).normal(3, 2, 1000)
    parts, once = Watch(), observe(Watch(), GOALS["time"], samples)
    for part in np.split(samples, [7, 7, 300, 999]):
        parts = observe(parts, GOALS["time"], part)
    assert (parts.n, parts.mean, parts.squares) == pytest.approx((once.n, once.mean, once.squares))
    assert once.squares == pytest.approx(np.var(samples) * 1000)


def test_nothing_is_claimed_early_nor_from_arenas_that_all_agree():
    assert observe(Watch(), GOALS["success"], np.ones(FIRST_LOOK - 1)).width is None
    equal = observe(Watch(), GOALS["time"], np.zeros(500))
    assert equal.width is None and not enough(equal, GOALS["time"])
    agreed = observe(Watch(), GOALS["success"], np.zeros(FIRST_LOOK))
    assert agreed.width > 0.05  # nobody failed: and yet not certain


def test_rows_are_paired_and_only_what_both_solved_counts():
    frame = rows(240)
    watch = Watch()
    for block in frame.with_columns(pl.col("arena") // 60).partition_by("arena"):
        shard = frame.join(block.select("point"), on="point", how="semi").filter(
            pl.col("arena") // 60 == block["arena"][0]
        )
        watch = look(watch, GOALS["time"], shard)
    sides = [frame.filter((pl.col("strategy") == name) & pl.col("success")) for name in ("full", "floor_only")]
    both = sides[0].join(sides[1], on="arena", suffix="_second")
    assert watch.arenas == 240 and watch.n == len(both)
    assert watch.mean == pytest.approx((both["time"] - both["time_second"]).mean())
