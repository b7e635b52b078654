"""Tuning on made-up missions whose best costs are known: it finds them, counts its missions, and says how it ended."""

import itertools

import numpy as np
import polars as pl
import pydantic
import pytest

from jaxbiped.executors.world_state import Planned
from jaxbiped.mission.batched_driver import Result, tally
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import MissionConfig
from jaxbiped.study.search import sobol
from jaxbiped.study.trials import objective
from jaxbiped.study.tuning import FIRST_TRAINING, TuneConfig, tune

BEST = np.array([2.0, 3.0, 4.0, 8.0])  # C1 to C4 of the made-up missions, in C0
SMALL = {"arenas": 48, "test_arenas": 60, "steps": 40, "batch": 16, "sweep": 1}


class Made:
    """Missions that take 600 s and more: 60 s for each squared logarithm off, noise by arena and rounded costs."""

    def __init__(self, bowl: float = 60.0, noise: float = 40.0):
        self.bowl, self.noise, self.asked = bowl, noise, []

    def __call__(self, costs, index, on_progress):
        self.asked.append((len(costs), index))
        off = np.log(costs[:, 1:] / costs[:, :1] / BEST)
        jumps = np.round(10 * off).astype(int)  # piecewise constant, as missions are
        luck = [[np.random.default_rng([*(row + 1000), k]).normal() for k in index] for row in jumps]
        time = 600 + 3.0 * (index % 7) + self.bowl * np.sum((jumps / 10) ** 2, 1)[:, None] + self.noise * np.array(luck)
        failed = time > 1200
        zero = np.zeros(time.shape)
        code = np.where(failed, Code.FELL, Code.REACHED)
        on_progress(tally(code.ravel()))
        whole = zero.astype(int)
        return Result(code, zero + 1, time, whole, whole, zero, zero, zero, Planned(zero, whole, zero))


def test_finds_the_best_costs_and_beats_the_start_and_the_sweep():
    told = []
    tuning = tune(TuneConfig(**SMALL), Made(), told.append)
    found = np.array(tuning.costs["tuned"])
    assert found[0] == 1.0 and np.all(np.abs(np.log(found[1:] / BEST)) < 0.5), found
    gaps = {(gap.first, gap.second): gap for gap in tuning.gaps}
    assert len(gaps) == 4 and gaps["tuned", "start"].objective.high < 0
    assert gaps["tuned", "sweep"].objective.high < 0
    assert told[-1].ended == told[-1].total >= told[-1].reached
    assert all(a.ended < b.ended for a, b in itertools.pairwise(told))


def test_training_and_test_arenas_are_apart_and_missions_are_counted():
    config, made = TuneConfig(**SMALL | {"sweep": 10}), Made()
    tuning = tune(config, made)
    seen = {points: set() for points in (1, 8, config.sweep_points, 4)}
    count = dict.fromkeys(seen, 0)
    for points, index in made.asked:
        seen[points] |= set(index.tolist())
        count[points] += points * len(index)
    assert seen[4] == set(range(60)) and min(seen[1] | seen[8] | seen[config.sweep_points]) == FIRST_TRAINING
    assert seen[8] == seen[1] == seen[config.sweep_points]
    assert count[1] + count[8] == config.tuning_missions
    assert count[config.sweep_points] >= 10 * config.tuning_missions
    assert len(tuning.swept) == config.sweep_points and len(tuning.history) == 40
    assert tuning.test.group_by("costs").len()["len"].to_list() == [60] * 4


def test_same_seed_same_costs_and_another_scale_the_same_paths():
    once, again = (tune(TuneConfig(**SMALL), Made()) for _ in range(2))
    assert once.costs == again.costs and once.history.equals(again.history) and once.gaps == again.gaps
    doubled = MissionConfig(costs={"c0": 2, "c1": 2, "c2": 10, "c3": 20, "c4": 200})
    scaled = tune(TuneConfig(**SMALL, mission=doubled), Made()).costs
    np.testing.assert_allclose(scaled["tuned"], 2 * np.array(once.costs["tuned"]), rtol=2e-3)  # four digits each
    other = tune(TuneConfig(**SMALL, seed=1), Made())
    assert other.costs["tuned"] != once.costs["tuned"]


def test_where_costs_do_nothing_nothing_changes():
    tuning = tune(TuneConfig(**SMALL), Made(bowl=0.0, noise=0.0))
    np.testing.assert_allclose(tuning.costs["tuned"], tuning.costs["start"], rtol=1e-3)
    gap = tuning.gaps[0]
    assert gap.objective.estimate == 0.0 and gap.objective.low is None  # all equal: no interval is made up


def test_a_loss_is_reported_as_one():
    """One wild step away from what is best already."""
    best = MissionConfig(costs=dict(zip(("c1", "c2", "c3", "c4"), BEST.tolist(), strict=True)))
    options = SMALL | {"steps": 1, "rate": 2.0, "sweep": 0}
    tuning = tune(TuneConfig(**options, mission=best), Made())
    assert {gap.first for gap in tuning.gaps} == {"tuned", "durations"} and "sweep" not in tuning.costs
    assert tuning.gaps[0].objective.low > 0 and len(tuning.swept) == 0


def test_costs_stay_in_the_box():
    inside = TuneConfig(**SMALL, low=2.5, high=3.5, rate=1.0)
    tuning = tune(inside, Made())
    for table in (tuning.history, tuning.swept):
        values = table.select("c1", "c2", "c3", "c4").to_numpy()
        assert values.min() >= 2.5 - 1e-9 and values.max() <= 3.5 + 1e-9
    assert tuning.costs["tuned"][1] == pytest.approx(2.5, rel=0.05) and tuning.costs["tuned"][4] == 3.5
    assert np.isfinite(sobol(3, np.log(2.5), np.log(3.5), 4, 0)).all()


def test_objective_of_missions():
    code = np.array([Code.REACHED, Code.REACHED, Code.FELL, Code.INVALID])
    time = np.array([500.0, 5000.0, 20.0, np.nan])
    rest = np.zeros(4)
    whole = rest.astype(int)
    result = Result(code, rest, time, whole, whole, rest, rest, rest, Planned(rest, whole, rest))
    assert objective(result, 1800.0).tolist() == [500.0, 1800.0, 1800.0, 1800.0]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"low": 5.0, "high": 5.0}, "high must be above low"),
        ({"families": ("bump", "bump")}, "must be distinct"),
        ({"strategy": "blind_stop"}, "full"),
        ({"mission": {"executor": "native"}}, "kinematic or sampled"),
        ({"steps": 0}, "greater than or equal to 1"),
        ({"penalty": float("nan")}, "finite"),
    ],
)
def test_what_cannot_be_tuned(options, said):
    with pytest.raises(pydantic.ValidationError, match=said):
        TuneConfig(**options)


def test_tables_have_no_nan():
    tuning = tune(TuneConfig(**SMALL), Made())
    for table in (tuning.history, tuning.swept, tuning.test):
        assert not table.select(pl.selectors.float().is_nan().any()).to_numpy().any()
