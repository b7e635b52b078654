"""Numbers of arenas from a pilot: against published values, and by simulating the study that they plan."""

import numpy as np
import polars as pl
import pytest
from scipy import stats

from jaxbiped.errors import InputError
from jaxbiped.statistics.paired import mcnemar
from jaxbiped.statistics.sample_size_plan import paired_t_sample_size, plan
from tests.study.synthetic import rows

FRAME = rows(240)
PAIR = ("full", "floor_only")


def test_paired_t_on_published_values():
    # Two-sided, alpha 0.05: Cohen (1988) and G*Power for the paired t test.
    assert paired_t_sample_size(0.5, 1.0, 0.8) == 34
    assert paired_t_sample_size(0.2, 1.0, 0.8) == 199
    assert paired_t_sample_size(0.8, 1.0, 0.8) == 15
    assert paired_t_sample_size(0.3, 1.0, 0.95) == 147


def test_the_planned_study_has_the_power_for_a_mean():
    rng = np.random.default_rng(0)
    n = paired_t_sample_size(6.0, 20.0, 0.8)
    p = stats.ttest_1samp(rng.normal(6.0, 20.0, (4000, n)), 0, axis=1).pvalue
    assert np.mean(p <= 0.05) == pytest.approx(0.8, abs=4 * np.sqrt(0.8 * 0.2 / 4000))


def test_the_planned_study_has_the_power_for_success():
    rng, made = np.random.default_rng(0), plan(FRAME, *PAIR, "success", 0.1)
    first, second = (made.spread + 0.1) / 2, (made.spread - 0.1) / 2
    counts = rng.multinomial(made.arenas, [first, second, 1 - first - second], size=1500)
    power = np.mean([mcnemar(int(a), int(b)) <= 0.05 for a, b, _ in counts])
    assert 0.8 - 4 * np.sqrt(0.16 / 1500) <= power <= 0.86  # exact tests overshoot: counts are whole


def test_time_is_planned_on_the_arenas_that_both_solve():
    made = plan(FRAME, *PAIR, "time", 20.0)
    assert made.pilot == 240 and 0 < made.solved < 240
    pairs = paired_t_sample_size(20.0, made.spread)
    assert made.arenas == int(np.ceil(pairs * 240 / made.solved))
    assert made.spread < made.spread_high and made.arenas < made.arenas_high


def test_a_pilot_without_discordance_plans_with_the_wanted_difference():
    same = [FRAME.filter(pl.col("strategy") == "full").with_columns(strategy=pl.lit(name)) for name in ("a", "b")]
    made = plan(pl.concat(same), "a", "b", "success", 0.05)
    assert made.spread == 0 and made.arenas > 100 and made.arenas_high >= made.arenas
    with pytest.raises(InputError, match="not all equal"):
        plan(pl.concat(same), "a", "b", "time", 5.0)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("success", 0.0), "wanted-difference"),
        (("success", 1.5), "below 1"),
        (("time", -3.0), "wanted-difference"),
        (("time", 5.0, 1.0), "power"),
        (("time", 5.0, 0.8, 0.0), "level"),
        (("cost", 5.0), "must be one of success"),
    ],
)
def test_what_cannot_be_planned(arguments, said):
    with pytest.raises(InputError, match=said):
        plan(FRAME, *PAIR, *arguments)
