"""What a population saved, by hand; no mission is played."""

import numpy as np
import polars as pl
import pytest

from jaxbiped.mission.params import MissionConfig
from jaxbiped.reproduction.paper import SAVED
from jaxbiped.reproduction.savings import (
    CROSSES,
    GOES_ROUND,
    always,
    break_even,
    measured_break_even,
    measures,
    population,
    study,
)
from jaxbiped.statistics.schema import SCHEMA

CONFIG = study(20, 3, "sampled")


@pytest.fixture(scope="module")
def frame():
    """Both strategies on 20 arenas: crossing saves k cm and 6 k s on arena k, but on arena 0, where one fails."""
    made = []
    for name in (CROSSES, GOES_ROUND):
        for k in range(20):
            good = k > 0 or name == CROSSES
            saved = 0.0 if name == GOES_ROUND else 1.0 * k
            row = dict.fromkeys(SCHEMA) | {
                "point": 0, "arena": k, "family": "bump", "difficulty": k / 20, "strategy": name,
                "code": "reached" if good else "fell", "success": good, "distance": 1.5 - saved / 100 if good else None,
                "time": 900.0 - 6 * saved if good else None, "walked": 1.0, "elapsed": 600.0, "measurements": 30,
                "decisions": 30, "goal_distance": 0.05, "reachable": True, "oracle_length": 1.4,
                "oracle_cost": 50.0 if name == CROSSES else 50.0 + k,
            }  # fmt: skip
            made.append({key: 0.0 if value is None and key.endswith("_error") else value for key, value in row.items()})
    return pl.DataFrame(made, schema=SCHEMA)


def test_only_arenas_that_both_solved_are_compared(frame):
    found = population(frame, CONFIG, 10.0)
    assert found.both["arena"].to_list() == list(range(1, 20))
    np.testing.assert_allclose(found.both["saved_distance"], np.arange(1, 20) / 100)
    np.testing.assert_allclose(found.both["saved_time"], 6.0 * np.arange(1, 20))
    assert found.both["crosses"].all()
    assert found.pair.first_only == 1 and found.pair.second_only == 0


def test_another_time_of_a_measurement_is_counted_for_each(frame):
    more = frame.with_columns(measurements=pl.when(pl.col("strategy") == CROSSES).then(20).otherwise(30).cast(pl.Int64))
    more = more.cast(dict(SCHEMA))
    ten, twelve = (population(more, CONFIG, seconds).both["saved_time"].to_numpy() for seconds in (10.0, 12.0))
    np.testing.assert_allclose(twelve - ten, 2.0 * (30 - 20))


def test_percentile_counts_ties_half(frame):
    found = population(frame, CONFIG, 10.0)
    assert found.percentile("saved_distance", 0.105) == pytest.approx(10 / 19)
    assert found.percentile("saved_time", 60.0) == pytest.approx((9 / 19 + 10 / 19) / 2)
    assert found.percentile("saved_distance", SAVED[0]) == 1.0


def test_measures_are_those_of_the_arenas():
    found = measures(np.arange(5), CONFIG)
    assert (found["width"] > 0.14).all() and (found["width"] < 0.46).all()
    assert (found["straight"] > 1.0).all() and (found["straight"] < 1.4).all()


def test_always_steps_as_if_it_were_floor():
    config = always(CONFIG)
    assert config.strategies == (CROSSES,) and config.mission.costs.c3 == MissionConfig().costs.c1
    assert (config.seed, config.arenas, config.mission.executor) == (CONFIG.seed, CONFIG.arenas, "sampled")


def test_break_even_of_table_2():
    """Two steps of 96 s in place of two cells of 16 s: 160 s, which are 6.15 cells of 26 s."""
    assert break_even(10.0) == pytest.approx(0.05 * 160 / 26)


@pytest.mark.parametrize("noise", [0.0, 20.0])
def test_break_even_of_a_plane(noise):
    rng = np.random.default_rng(0)
    width, detour = rng.uniform(0.15, 0.45, 200), rng.uniform(0.0, 0.9, 200)
    saved = 400 * detour - 100 * (width - np.median(width)) - 140 + noise * rng.standard_normal(200)
    frame = pl.DataFrame({"width": width, "detour": detour, "saved_time": saved, "crosses": [True] * 200})
    found = measured_break_even(frame)
    assert found.detour == pytest.approx(0.35, abs=1e-6 + 0.001 * noise)
    assert found.low - 1e-6 <= 0.35 <= found.high + 1e-6 and found.high - found.low < 0.05
    assert measured_break_even(frame.with_columns(saved_time=-pl.col("saved_time"))) is None
    assert measured_break_even(frame.head(9)) is None
